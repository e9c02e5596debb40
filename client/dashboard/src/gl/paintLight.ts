/** The colours of light in flight, as the shader has them, for whatever draws without it. */
import { densityImage } from "../physics/densityImage";
import type { Coefficients } from "../physics/maximumEntropy";
import { colourTable, LEVELS, type ColourMapName } from "../ui/colourMaps";
import type { Backdrop, Exposure } from "./renderer";
import { backdropGrey, strength, toned } from "./tone";

const OPAQUE = 0xff000000;

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
    const [reds, greens, blues] = channelsOf(colours);
    const fades = backdrop !== null;
    for (let pixel = 0; pixel < density.length; pixel++) {
      const share = density[pixel] / white;
      const place = share > 0 ? toned(kind, share) : 0; // NaN: no density, no light
      const level = (place * LEVELS) | 0;
      const added = fades ? strength(place) : 1;
      const dark = free[pixel];
      // 255 (1 - (1 - grey) (1 - light)), rounded
      const red = (255.5 - dark * (255 - added * reds[level])) | 0;
      const green = (255.5 - dark * (255 - added * greens[level])) | 0;
      const blue = (255.5 - dark * (255 - added * blues[level])) | 0;
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

const channels = new Map<ColourMapName, readonly Float64Array[]>();

/** Red, green and blue of every level; the end of the last one has its colour. */
function channelsOf(colours: ColourMapName): readonly Float64Array[] {
  let known = channels.get(colours);
  if (known === undefined) {
    const table = colourTable(colours);
    known = [0, 1, 2].map((channel) => Float64Array.from({ length: LEVELS + 1 }, (_, level) => table[4 * Math.min(level, LEVELS - 1) + channel]));
    channels.set(colours, known);
  }
  return known;
}
