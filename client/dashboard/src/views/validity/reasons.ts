/** Flags, or why ranges are not trusted, as a picture and as counts. */
import { rgbaOf } from "../../scales/colourMaps";
import { DISTRUST, FLAGS, type Flag } from "../../ui/flags";

/** What can be wrong with a pixel, the gravest first, and how its values say so. */
export interface Reasons {
  readonly product: string;
  readonly all: readonly Flag[];
  readonly has: (value: number, reason: Flag) => boolean;
  /** What a pixel is called that nothing was wrong with, and what that means. */
  readonly good: readonly [title: string, words: string];
}

export const REASONS = {
  flags: { product: "flags", all: FLAGS, has: (value, { bit }) => (value & bit) !== 0, good: ["Valid", "nothing was wrong"] },
  trust: {
    product: "trust",
    all: DISTRUST,
    has: (value, { bit }) => value === bit,
    good: ["Trusted", "the 90 % interval holds the range"],
  },
} satisfies Readonly<Record<string, Reasons>>;

/**
 * Writes RGBA bytes: the colour of the gravest that is wrong with a pixel, and a grey for its light where nothing is.
 * `white` is the light shown brightest.
 */
export function paintReasons(
  { all, has }: Reasons,
  values: ArrayLike<number>,
  light: ArrayLike<number> | null,
  white: number,
  rgba: Uint8ClampedArray,
): void {
  const colours = Uint32Array.from({ length: 256 }, (_, value) => {
    const reason = all.find((each) => has(value, each));
    return reason === undefined ? 0 : rgbaOf(reason.colour.slice(1));
  });
  const pixels = new Uint32Array(rgba.buffer, rgba.byteOffset, rgba.byteLength / 4);
  for (let pixel = 0; pixel < pixels.length; pixel++) {
    const colour = colours[values[pixel]];
    if (colour !== 0) {
      pixels[pixel] = colour;
      continue;
    }
    const share = light === null ? 0.5 : light[pixel] / white;
    const grey = share > 0 ? Math.round(34 + 187 * Math.sqrt(Math.min(1, share))) : 34;
    pixels[pixel] = (0xff000000 | (grey << 16) | (grey << 8) | grey) >>> 0;
  }
}

export interface Counts {
  readonly total: number;
  readonly valid: number;
  /** Pixels with each reason by its name; one with two counts for both. */
  readonly byName: Readonly<Record<string, number>>;
}

export function countReasons({ all, has }: Reasons, values: ArrayLike<number>): Counts {
  const seen = new Uint32Array(256);
  for (let pixel = 0; pixel < values.length; pixel++) seen[values[pixel]]++;
  const byName = Object.fromEntries(
    all.map((reason) => [reason.name, seen.reduce((sum, count, value) => sum + (has(value, reason) ? count : 0), 0)]),
  );
  return { total: values.length, valid: seen[0], byName };
}
