/** Which pixel is worth looking at before the user chose one. */
import { peaks } from "../../physics/impulseResponse";
import type { Coefficients } from "../../physics/maximumEntropy";
import type { Pixel } from "../../store/pixel";

/** Pixels looked at, on a grid over the picture. */
const COLUMNS = 16;
const ROWS = 10;
/** Least share of its light that makes a peak count. */
const LEAST_SHARE = 0.1;

/** The pixel of a grid with the most returns; of several, the one whose second return is the strongest. Null where none has a density. */
export function richestPixel(c: Coefficients): Pixel | null {
  let best: (Pixel & { readonly score: number }) | null = null;
  for (let row = 0; row < ROWS; row++) {
    for (let column = 0; column < COLUMNS; column++) {
      const x = Math.floor(((column + 0.5) / COLUMNS) * c.width);
      const y = Math.floor(((row + 0.5) / ROWS) * c.height);
      const strong = peaks(c, y * c.width + x).filter(({ share }) => share >= LEAST_SHARE);
      // The share of the second is below one: it decides between pixels with equally many.
      const score = strong.length + (strong[1]?.share ?? 0);
      if (strong.length > 0 && score > (best?.score ?? 0)) best = { x, y, score };
    }
  }
  return best === null ? null : { x: best.x, y: best.y };
}
