import type { Coefficients } from "../physics/maximumEntropy";
import { LightPainter } from "./paintLight";
import type { DensityRenderer, Exposure } from "./renderer";
import { WebGl2Renderer } from "./webgl2";

/** Names of drivers that run shaders on the processor, where typed arrays take half as long. */
const EMULATED = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** WebGL2 where the browser grants it and `webGl2` asks for it, typed arrays otherwise. */
export function createRenderer(canvas: HTMLCanvasElement, webGl2: boolean): DensityRenderer {
  return (webGl2 ? WebGl2Renderer.create(canvas) : null) ?? new TypedArrayRenderer(canvas);
}

let found: boolean | null = null;

/** Whether this browser draws by WebGL2 on a graphics processor. */
export function hasGraphics(): boolean {
  found ??= drawsOnGraphics();
  return found;
}

/** Asks on a canvas of its own: one that had a context of WebGL gets none of another kind. */
function drawsOnGraphics(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (gl === null) return false;
  const unmasked = gl.getExtension("WEBGL_debug_renderer_info");
  const driver = String(gl.getParameter(unmasked?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return !EMULATED.test(driver);
}

/** Draws with typed arrays on a 2D canvas, for browsers that refuse WebGL2 or emulate it. */
class TypedArrayRenderer implements DensityRenderer {
  readonly kind = "typed-array";
  readonly #context: CanvasRenderingContext2D;
  readonly #painter = new LightPainter();
  #image: ImageData | null = null;

  constructor(private readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser grants neither WebGL2 nor a 2D canvas.");
    this.#context = context;
  }

  draw(coefficients: Coefficients, exposure: Exposure): void {
    const { width, height } = coefficients;
    const image = this.#imageOf(width, height);
    this.#painter.paint(coefficients, exposure, new Uint32Array(image.data.buffer));
    this.#context.putImageData(image, 0, 0);
  }

  readDensity(coefficients: Coefficients, phase_rad: number): Float32Array {
    return this.#painter.density(coefficients, phase_rad).slice();
  }

  onLost(): void {
    // A 2D canvas is never lost for good: the browser restores it by itself.
  }

  dispose(): void {
    this.#image = null;
  }

  #imageOf(width: number, height: number): ImageData {
    if (this.#image?.width !== width || this.#image.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.#image = this.#context.createImageData(width, height);
    }
    return this.#image;
  }
}
