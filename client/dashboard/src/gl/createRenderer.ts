import type { DensityRenderer } from "./renderer";
import { TypedArrayRenderer } from "./typedArray";
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
