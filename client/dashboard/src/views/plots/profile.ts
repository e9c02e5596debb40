/** Values of a map along a line. */
import type { Pixel } from "../../store/pixel";

/** A map's values from one pixel to another, both included: a sample for each column or row that the line crosses, whichever are more. */
export interface Profile {
  /** Distance from the first pixel, in pixels. */
  readonly distance_px: number[];
  /** Null where the nearest pixel has no value. */
  readonly values: (number | null)[];
}

export function profileOf(map: ArrayLike<number>, width: number, from: Pixel, to: Pixel): Profile {
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  const steps = Math.max(Math.abs(dx), Math.abs(dy), 1);
  const shares = Array.from({ length: steps + 1 }, (_, n) => n / steps);
  return {
    distance_px: shares.map((share) => share * Math.hypot(dx, dy)),
    values: shares.map((share) => {
      const value = map[Math.round(from.y + share * dy) * width + Math.round(from.x + share * dx)];
      return Number.isFinite(value) ? value : null;
    }),
  };
}
