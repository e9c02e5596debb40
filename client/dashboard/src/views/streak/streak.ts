/** A streak image: one row of the picture over time (Fig. 15). */
import type { Coefficients } from "../../physics/maximumEntropy";
import { Poles } from "../../physics/poles";
import { type ColourMapName, colourTable, levelOf } from "../../scales/colourMaps";
import { type ToneKind, toned } from "../../scales/tone";

/** Times of a streak image over one period. */
export const BINS = 256;

/**
 * Mean density within each bin of time, so that no peak falls between two of them.
 *
 * The room is kept from frame to frame: poles begin where those of the last frame stood.
 */
export class Streak {
  #poles = new Poles(1, 0);
  /** (BINS, width), units of b_0 per second; NaN where a pixel has no density. */
  values = new Float32Array(0);
  width = 0;
  #row = -1;

  compute(c: Coefficients, row: number): void {
    if (this.#poles.harmonics !== c.harmonics || this.#poles.area !== c.width) {
      this.#poles = new Poles(c.harmonics, c.width);
      this.values = new Float32Array(BINS * c.width);
      this.width = c.width;
    } else if (row !== this.#row) {
      this.#poles = new Poles(c.harmonics, c.width);
    }
    this.#row = row;
    const perBin = BINS * c.baseFrequency_hz;
    for (let x = 0; x < c.width; x++) {
      this.#poles.findOne(c, row * c.width + x, x);
      let before = 0;
      for (let bin = 0; bin < BINS; bin++) {
        const after = this.#poles.upTo(x, (2 * Math.PI * (bin + 1)) / BINS);
        this.values[bin * c.width + x] = (after - before) * perBin;
        before = after;
      }
    }
  }
}

const QUANTILE = 0.995;

/** The density that nearly all of a streak stays below; NaN where there is no light. */
export function whiteOf(values: Float32Array): number {
  const light = values.filter((value) => value > 0).sort();
  return light.length === 0 ? NaN : light[Math.floor(QUANTILE * (light.length - 1))];
}

/** Writes RGBA bytes; clear where there is no density. */
export function paintStreak(values: Float32Array, white: number, tone: ToneKind, colours: ColourMapName, rgba: Uint8ClampedArray): void {
  const table = new Uint32Array(colourTable(colours).buffer);
  const pixels = new Uint32Array(rgba.buffer, rgba.byteOffset, rgba.byteLength / 4);
  for (let at = 0; at < pixels.length; at++) {
    pixels[at] = Number.isNaN(values[at]) ? 0 : table[levelOf(toned(tone, values[at] / white))];
  }
}
