/** Which point is under the pointer. */

/** How far a point may be from the pointer to be meant, in CSS px. */
const REACH_PX = 8;

type Seen = Readonly<{ x: number; y: number; depth: number }>;

/** Where a point is on a screen of this size, in px from its upper left; null behind the eye. `matrix` is projection times view, by columns. */
export function onScreen(matrix: ArrayLike<number>, x: number, y: number, z: number, width: number, height: number): Seen | null {
  const depth = matrix[3] * x + matrix[7] * y + matrix[11] * z + matrix[15];
  if (depth <= 0) return null;
  const across = (matrix[0] * x + matrix[4] * y + matrix[8] * z + matrix[12]) / depth;
  const up = (matrix[1] * x + matrix[5] * y + matrix[9] * z + matrix[13]) / depth;
  return { x: (0.5 + 0.5 * across) * width, y: (0.5 - 0.5 * up) * height, depth };
}

/** The foremost of the first `count` points near a place on the screen, and the nearest to it of those about as far; null for none. */
export function pointUnder(
  positions: Float32Array,
  count: number,
  matrix: ArrayLike<number>,
  width: number,
  height: number,
  place: { readonly x: number; readonly y: number },
): number | null {
  let found: number | null = null;
  let least = Infinity;
  for (let n = 0; n < count; n++) {
    const at = onScreen(matrix, positions[3 * n], positions[3 * n + 1], positions[3 * n + 2], width, height);
    if (at === null) continue;
    const apart = Math.hypot(at.x - place.x, at.y - place.y);
    if (apart > REACH_PX) continue;
    // A surface has many points in reach, and some stray before it: a pixel off counts as much as 3 % further away.
    const cost = Math.log(at.depth) + 0.03 * apart;
    if (cost < least) [found, least] = [n, cost];
  }
  return found;
}
