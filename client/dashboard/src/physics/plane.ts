/** The plane through points in space, by least squares of the distances from it. */

/** A point or a direction. */
type Vector = readonly [number, number, number];

export interface Plane {
  /** Of length 1. */
  readonly normal: Vector;
  /** Standard deviation of the points' distances from the plane, with N - 3: a plane has three parameters. In units of the points. */
  readonly residual: number;
}

/** Eigenvalues below this share of the largest count as zero: the points lie on a line. */
const FLAT = 1e-12;

/** The plane that points (x, y, z after each other) are nearest to; null where they are fewer than four, or lie on a line. */
export function planeThrough(points: ArrayLike<number>): Plane | null {
  const count = Math.floor(points.length / 3);
  if (count < 4) return null;
  const centre = [0, 1, 2].map((axis) => meanOf(count, (n) => points[3 * n + axis])) as unknown as Vector;
  const spread = (a: number, b: number): number => meanOf(count, (n) => (points[3 * n + a] - centre[a]) * (points[3 * n + b] - centre[b]));
  const normal = leastDirection([spread(0, 0), spread(1, 1), spread(2, 2)], [spread(0, 1), spread(1, 2), spread(0, 2)]);
  if (normal === null) return null;
  // From the distances themselves: the least eigenvalue would be a difference of large numbers.
  const squares = meanOf(count, (n) => normal.reduce((sum, part, axis) => sum + part * (points[3 * n + axis] - centre[axis]), 0) ** 2);
  return { normal, residual: Math.sqrt((squares * count) / (count - 3)) };
}

function meanOf(count: number, value: (n: number) => number): number {
  let sum = 0;
  for (let n = 0; n < count; n++) sum += value(n);
  return sum / count;
}

/** Eigenvector to the least eigenvalue of a symmetric matrix (O. K. Smith, CACM 4(4), 1961); null where the least two are both zero. */
function leastDirection([xx, yy, zz]: Vector, [xy, yz, xz]: Vector): Vector | null {
  const mean = (xx + yy + zz) / 3;
  const p = Math.sqrt(((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * (xy ** 2 + yz ** 2 + xz ** 2)) / 6);
  if (!(p > 0)) return null;
  const determinant =
    (xx - mean) * ((yy - mean) * (zz - mean) - yz ** 2) - xy * (xy * (zz - mean) - yz * xz) + xz * (xy * yz - (yy - mean) * xz);
  const angle = Math.acos(Math.min(1, Math.max(-1, determinant / (2 * p ** 3)))) / 3;
  const least = mean + 2 * p * Math.cos(angle + (2 * Math.PI) / 3);
  // Every row of the matrix less the eigenvalue is perpendicular to the eigenvector.
  const first: Vector = [xx - least, xy, xz];
  const second: Vector = [xy, yy - least, yz];
  const third: Vector = [xz, yz, zz - least];
  const normals = [cross(first, second), cross(second, third), cross(third, first)];
  const [found] = normals.sort((a, b) => Math.hypot(...b) - Math.hypot(...a));
  const length = Math.hypot(...found);
  if (!(length > FLAT * (mean + 2 * p) ** 2)) return null;
  return [found[0] / length, found[1] / length, found[2] / length];
}

function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Angle between a plane's normal and the axis that the camera looks along (z), from 0 to a right angle, in rad. */
export function tiltOf({ normal }: Plane): number {
  return Math.acos(Math.min(1, Math.abs(normal[2])));
}
