import type { Coefficients } from "../physics/maximumEntropy";
import { type ColourMapName, colourTable, LEVELS } from "../scales/colourMaps";
import { toneIndex } from "../scales/tone";
import type { Backdrop, DensityRenderer, Exposure } from "./renderer";
import { FRAGMENT_SHADER, VERTEX_SHADER } from "./shader";
import { layersOf, packTexels } from "./texels";

const UNIFORMS = [
  "coefficients",
  "backdrop",
  "colours",
  "layers",
  "z",
  "baseFrequencyHz",
  "white",
  "backdropWhite",
  "tone",
  "asNumbers",
] as const;

type Uniforms = Record<(typeof UNIFORMS)[number], WebGLUniformLocation | null>;

/** Texture units, one a sampler. */
const [COEFFICIENTS, BACKDROP, COLOURS] = [0, 1, 2];

/** Draws in a WebGL2 fragment shader; coefficients go to the graphics memory once a frame. */
export class WebGl2Renderer implements DensityRenderer {
  readonly kind = "webgl2";
  readonly #canvas: HTMLCanvasElement;
  readonly #gl: WebGL2RenderingContext;
  readonly #uniforms: Uniforms;
  #lost: (() => void) | null = null;
  #uploaded: Coefficients | null = null;
  #layout = "";
  #texels = new Float32Array(0);
  #backdrop: Backdrop["values"] | null = null;
  #backdropLayout = "";
  #colours: ColourMapName | null = null;

  /** A renderer on `canvas`, or null where the browser refuses WebGL2. */
  static create(canvas: HTMLCanvasElement): WebGl2Renderer | null {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, stencil: false, powerPreference: "low-power" });
    return gl === null ? null : new WebGl2Renderer(canvas, gl);
  }

  private constructor(canvas: HTMLCanvasElement, gl: WebGL2RenderingContext) {
    this.#canvas = canvas;
    this.#gl = gl;
    const program = link(gl);
    gl.useProgram(program);
    this.#uniforms = Object.fromEntries(UNIFORMS.map((name) => [name, gl.getUniformLocation(program, name)])) as Uniforms;
    gl.uniform1i(this.#uniforms.coefficients, COEFFICIENTS);
    gl.uniform1i(this.#uniforms.backdrop, BACKDROP);
    gl.uniform1i(this.#uniforms.colours, COLOURS);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    // Every sampler the shader names needs a texture, also while there is no backdrop.
    this.#bind(BACKDROP, gl.TEXTURE_2D);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32F, 1, 1);
    canvas.addEventListener("webglcontextlost", this.#onContextLost);
  }

  draw(coefficients: Coefficients, { phase_rad, tone, colours, backdrop }: Exposure): void {
    const gl = this.#gl;
    if (gl.isContextLost()) return;
    const { width, height } = coefficients;
    if (this.#canvas.width !== width || this.#canvas.height !== height) {
      this.#canvas.width = width;
      this.#canvas.height = height;
    }
    this.#upload(coefficients);
    this.#uploadBackdrop(backdrop, width, height);
    this.#uploadColours(colours);
    gl.uniform1f(this.#uniforms.white, tone.white);
    gl.uniform1f(this.#uniforms.backdropWhite, backdrop?.white ?? 0);
    gl.uniform1i(this.#uniforms.tone, toneIndex(tone.kind));
    gl.uniform1i(this.#uniforms.asNumbers, 0);
    this.#shade(coefficients, phase_rad);
  }

  readDensity(coefficients: Coefficients, phase_rad: number): Float32Array {
    const gl = this.#gl;
    if (gl.getExtension("EXT_color_buffer_float") === null) {
      throw new Error("This browser cannot read a density back: no EXT_color_buffer_float.");
    }
    const { width, height } = coefficients;
    const target = gl.createRenderbuffer();
    const framebuffer = gl.createFramebuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, target);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA32F, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, target);
    this.#upload(coefficients);
    gl.uniform1i(this.#uniforms.asNumbers, 1);
    this.#shade(coefficients, phase_rad);
    const rgba = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, rgba);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(framebuffer);
    gl.deleteRenderbuffer(target);
    return Float32Array.from({ length: width * height }, (_, pixel) => rgba[4 * pixel]);
  }

  onLost(listener: () => void): void {
    this.#lost = listener;
  }

  dispose(): void {
    this.#canvas.removeEventListener("webglcontextlost", this.#onContextLost);
    this.#gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  readonly #onContextLost = (): void => this.#lost?.();

  #shade(coefficients: Coefficients, phase_rad: number): void {
    const gl = this.#gl;
    gl.uniform1i(this.#uniforms.layers, layersOf(coefficients.harmonics));
    gl.uniform2f(this.#uniforms.z, Math.cos(phase_rad), Math.sin(phase_rad));
    gl.uniform1f(this.#uniforms.baseFrequencyHz, coefficients.baseFrequency_hz);
    gl.viewport(0, 0, coefficients.width, coefficients.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  #upload(coefficients: Coefficients): void {
    if (this.#uploaded === coefficients) return;
    const gl = this.#gl;
    const { width, height } = coefficients;
    const layers = layersOf(coefficients.harmonics);
    const layout = `${width}x${height}x${layers}`;
    if (this.#layout !== layout) {
      this.#bind(COEFFICIENTS, gl.TEXTURE_2D_ARRAY);
      gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA32F, width, height, layers);
      this.#texels = new Float32Array(4 * width * height * layers);
      this.#layout = layout;
    }
    packTexels(coefficients, this.#texels);
    gl.activeTexture(gl.TEXTURE0 + COEFFICIENTS);
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, width, height, layers, gl.RGBA, gl.FLOAT, this.#texels);
    this.#uploaded = coefficients;
  }

  #uploadBackdrop(backdrop: Backdrop | null, width: number, height: number): void {
    if (backdrop === null || this.#backdrop === backdrop.values) return;
    const gl = this.#gl;
    const layout = `${width}x${height}`;
    if (this.#backdropLayout !== layout) {
      this.#bind(BACKDROP, gl.TEXTURE_2D);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32F, width, height);
      this.#backdropLayout = layout;
    }
    gl.activeTexture(gl.TEXTURE0 + BACKDROP);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED, gl.FLOAT, backdrop.values);
    this.#backdrop = backdrop.values;
  }

  #uploadColours(name: ColourMapName): void {
    if (this.#colours === name) return;
    const gl = this.#gl;
    if (this.#colours === null) {
      this.#bind(COLOURS, gl.TEXTURE_2D);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, LEVELS, 1);
    }
    gl.activeTexture(gl.TEXTURE0 + COLOURS);
    const bytes = new Uint8Array(colourTable(name).buffer);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, LEVELS, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    this.#colours = name;
  }

  /** Puts a fresh texture, read without interpolation, into a unit and frees the one it held. */
  #bind(unit: number, target: GLenum): void {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    const held = target === gl.TEXTURE_2D ? gl.TEXTURE_BINDING_2D : gl.TEXTURE_BINDING_2D_ARRAY;
    gl.deleteTexture(gl.getParameter(held) as WebGLTexture | null);
    gl.bindTexture(target, gl.createTexture());
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texParameteri(target, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(target, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }
}

function link(gl: WebGL2RenderingContext): WebGLProgram {
  const program = gl.createProgram();
  for (const [type, source] of [
    [gl.VERTEX_SHADER, VERTEX_SHADER],
    [gl.FRAGMENT_SHADER, FRAGMENT_SHADER],
  ] as const) {
    const shader = gl.createShader(type);
    if (shader === null) throw new Error("The graphics context was lost while it was set up.");
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(`The shader does not link: ${gl.getProgramInfoLog(program) ?? "no reason given"}`);
  }
  return program;
}
