import { densityImage, type Coefficients } from "../physics/maximumEntropy";
import { lightPainter } from "./paintLight";
import type { DensityRenderer, Exposure } from "./renderer";

/** Draws with typed arrays on a 2D canvas, for browsers that refuse WebGL2. */
export class TypedArrayRenderer implements DensityRenderer {
  readonly kind = "typed-array";
  readonly #canvas: HTMLCanvasElement;
  readonly #context: CanvasRenderingContext2D;
  #image: ImageData | null = null;
  #density = new Float32Array(0);

  constructor(canvas: HTMLCanvasElement) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser grants neither WebGL2 nor a 2D canvas.");
    this.#canvas = canvas;
    this.#context = context;
  }

  draw(coefficients: Coefficients, exposure: Exposure): void {
    const { width, height } = coefficients;
    const density = this.#densityOf(coefficients, exposure.phase_rad);
    const { data } = this.#imageOf(width, height);
    const paint = lightPainter(density, exposure);
    for (let pixel = 0; pixel < density.length; pixel++) {
      paint(pixel, data, 4 * pixel);
      data[4 * pixel + 3] = 255;
    }
    this.#context.putImageData(this.#imageOf(width, height), 0, 0);
  }

  readDensity(coefficients: Coefficients, phase_rad: number): Float32Array {
    return this.#densityOf(coefficients, phase_rad).slice();
  }

  onLost(): void {
    // A 2D canvas is never lost for good: the browser restores it by itself.
  }

  dispose(): void {
    this.#image = null;
    this.#density = new Float32Array(0);
  }

  #densityOf(coefficients: Coefficients, phase_rad: number): Float32Array {
    const area = coefficients.width * coefficients.height;
    if (this.#density.length !== area) this.#density = new Float32Array(area);
    densityImage(coefficients, phase_rad, this.#density);
    return this.#density;
  }

  #imageOf(width: number, height: number): ImageData {
    if (this.#image?.width !== width || this.#image.height !== height) {
      this.#canvas.width = width;
      this.#canvas.height = height;
      this.#image = this.#context.createImageData(width, height);
    }
    return this.#image;
  }
}
