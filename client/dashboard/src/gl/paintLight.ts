/** The colours of light in flight, as the shader has them, for whatever draws without it. */
import { densityImage } from "../physics/densityImage";
import type { Coefficients } from "../physics/maximumEntropy";
import { type ColourMapName, colourTable, LEVELS } from "../scales/colourMaps";
import { backdropGrey, strength, type ToneKind, toned } from "../scales/tone";
import type { Backdrop, Exposure } from "./renderer";

const OPAQUE = 0xff000000;
/** Steps of the place on the colour map, many to each colour: what light adds to the scene is within 0.07 of 255 there. */
const STEPS = 64 * LEVELS;

/** Paints pictures of one size, one after another: what two of them have in common is computed once. */
export class LightPainter {
  #density = new Float32Array(0);
  /** What the still scene leaves of white: 1 less its grey. */
  #free = new Float32Array(0);
  #backdrop: Backdrop | null = null;

  /** Density of every pixel, in units of b_0 per second, until the next picture. */
  density(coefficients: Coefficients, phase_rad: number): Float32Array {
    const area = coefficients.width * coefficients.height;
    if (this.#density.length !== area) this.#density = new Float32Array(area);
    densityImage(coefficients, phase_rad, this.#density);
    return this.#density;
  }

  /** Writes a picture as RGBA pixels (little endian, as all browsers are); the backdrop has as many pixels. */
  paint(coefficients: Coefficients, { phase_rad, tone: { kind, white }, colours, backdrop }: Exposure, pixels: Uint32Array): void {
    const density = this.density(coefficients, phase_rad);
    this.#take(backdrop, density.length);
    const free = this.#free;
    placesOf(kind, white, density);
    const table = freeOf(colours, backdrop !== null);
    for (let pixel = 0; pixel < density.length; pixel++) {
      const at = 4 * ((density[pixel] * STEPS) | 0);
      const dark = free[pixel];
      // 255 (1 - (1 - grey) (1 - light)), rounded
      const red = (255.5 - dark * table[at]) | 0;
      const green = (255.5 - dark * table[at + 1]) | 0;
      const blue = (255.5 - dark * table[at + 2]) | 0;
      pixels[pixel] = OPAQUE | (blue << 16) | (green << 8) | red;
    }
  }

  #take(backdrop: Backdrop | null, area: number): void {
    const same = this.#backdrop?.values === backdrop?.values && this.#backdrop?.white === backdrop?.white;
    if (same && this.#free.length === area) return;
    if (this.#free.length !== area) this.#free = new Float32Array(area);
    this.#backdrop = backdrop;
    if (backdrop === null) this.#free.fill(1);
    else for (let pixel = 0; pixel < area; pixel++) this.#free[pixel] = 1 - backdropGrey(backdrop.values[pixel] / backdrop.white);
  }
}

/** Makes places on the colour map of densities, one loop for each tone; 0 where there is none. */
function placesOf(kind: ToneKind, white: number, density: Float32Array): void {
  if (kind === "logarithmic") {
    for (let pixel = 0; pixel < density.length; pixel++) density[pixel] = density[pixel] > 0 ? toned(kind, density[pixel] / white) : 0;
    return;
  }
  const root = kind === "root";
  for (let pixel = 0; pixel < density.length; pixel++) {
    const share = density[pixel] / white;
    const bounded = share > 0 ? Math.min(share, 1) : 0; // NaN: no density, no light
    density[pixel] = root ? Math.sqrt(bounded) : bounded;
  }
}

const tables = new Map<string, Float32Array>();

/** What light leaves of white in red, green, blue (and nothing), at every step of its place; over a still scene dim light fades in. */
function freeOf(colours: ColourMapName, fades: boolean): Float32Array {
  const name = `${colours} ${fades}`;
  let known = tables.get(name);
  if (known === undefined) {
    known = new Float32Array(4 * (STEPS + 1));
    const table = colourTable(colours);
    for (let step = 0; step <= STEPS; step++) {
      const level = Math.min(LEVELS - 1, Math.floor((step * LEVELS) / STEPS));
      const added = fades ? strength((step + 0.5) / STEPS) : 1;
      for (let channel = 0; channel < 3; channel++) known[4 * step + channel] = 255 - added * table[4 * level + channel];
    }
    tables.set(name, known);
  }
  return known;
}
