import { densityImage, type Coefficients } from "../physics/maximumEntropy";
import { colourTable, levelOf } from "../ui/colourMaps";
import type { DensityRenderer, Exposure } from "./renderer";
import { backdropGrey, strength, toned } from "./tone";

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

  draw(coefficients: Coefficients, { phase_rad, tone, colours, backdrop }: Exposure): void {
    const { width, height } = coefficients;
    const density = this.#densityOf(coefficients, phase_rad);
    const { data } = this.#imageOf(width, height);
    const table = colourTable(colours);
    for (let pixel = 0; pixel < density.length; pixel++) {
      const share = density[pixel] / tone.white;
      const place = share >= 0 ? toned(tone.kind, share) : 0; // NaN: no density, no light
      const level = 4 * levelOf(place);
      const grey = backdrop === null ? 0 : backdropGrey(backdrop.values[pixel] / backdrop.white);
      const added = backdrop === null ? 1 : strength(place);
      for (let channel = 0; channel < 3; channel++) {
        const light = (added * table[level + channel]) / 255;
        data[4 * pixel + channel] = 255 * (1 - (1 - grey) * (1 - light));
      }
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
