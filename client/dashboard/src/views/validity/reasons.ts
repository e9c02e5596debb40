/** Flags as a picture and as counts. */
import { FLAGS, gravest } from "../../ui/flags";

const COLOURS = new Uint32Array(256);
for (let bits = 0; bits < 256; bits++) {
  const flag = gravest(bits);
  const rgb = flag === null ? 0 : parseInt(flag.colour.slice(1), 16);
  // RGBA bytes on a little-endian machine, as every browser's is
  COLOURS[bits] = flag === null ? 0 : 0xff000000 | ((rgb & 0xff) << 16) | (rgb & 0xff00) | (rgb >> 16);
}

/**
 * Writes RGBA bytes: the colour of a pixel's gravest flag, and a grey for its light where nothing was wrong.
 * `white` is the light shown brightest.
 */
export function paintFlags(flags: ArrayLike<number>, light: ArrayLike<number> | null, white: number, rgba: Uint8ClampedArray): void {
  const pixels = new Uint32Array(rgba.buffer, rgba.byteOffset, rgba.byteLength / 4);
  for (let pixel = 0; pixel < pixels.length; pixel++) {
    const colour = COLOURS[flags[pixel]];
    if (colour !== 0) {
      pixels[pixel] = colour;
      continue;
    }
    const share = light === null ? 0.5 : light[pixel] / white;
    const grey = share > 0 ? Math.round(34 + 187 * Math.sqrt(Math.min(1, share))) : 34;
    pixels[pixel] = (0xff000000 | (grey << 16) | (grey << 8) | grey) >>> 0;
  }
}

export interface FlagCounts {
  readonly total: number;
  readonly valid: number;
  /** Pixels that carry each flag; one with two counts for both. */
  readonly byFlag: Readonly<Record<string, number>>;
}

export function countFlags(flags: ArrayLike<number>): FlagCounts {
  const seen = new Uint32Array(256);
  for (let pixel = 0; pixel < flags.length; pixel++) seen[flags[pixel]]++;
  const byFlag = Object.fromEntries(
    FLAGS.map(({ bit, name }) => [name, seen.reduce((sum, count, bits) => sum + ((bits & bit) !== 0 ? count : 0), 0)]),
  );
  return { total: flags.length, valid: seen[0], byFlag };
}
