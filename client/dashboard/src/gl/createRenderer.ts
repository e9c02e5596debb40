import type { DensityRenderer } from "./renderer";
import { TypedArrayRenderer } from "./typedArray";
import { WebGl2Renderer } from "./webgl2";

/** WebGL2 where the browser grants it and `webGl2` asks for it, typed arrays otherwise. */
export function createRenderer(canvas: HTMLCanvasElement, webGl2: boolean): DensityRenderer {
  return (webGl2 ? WebGl2Renderer.create(canvas) : null) ?? new TypedArrayRenderer(canvas);
}
