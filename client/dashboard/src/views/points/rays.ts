/** Along which rays the pixels of a camera look, as the service's point clouds have them. */

/** A pinhole camera, in pixels: a pixel looks along ((x - cx) / fx, (y - cy) / fy, 1), y down; centres are whole numbers. */
export type Pinhole = Readonly<{ fx: number; fy: number; cx: number; cy: number }>;

/** A camera whose lens bends rays, and whose light may stand aside, in m to the right, below and before the lens. */
export interface Lens extends Pinhole {
  /** k1, k2, p1, p2, k3 of Brown and Conrady, or none. */
  readonly distortion?: readonly number[];
  readonly light_x_m?: number;
  readonly light_y_m?: number;
  readonly light_z_m?: number;
}

const STEPS = 50;
const CLOSE = 1e-12;

/** The ray (x, y, 1) that a lens bends to where a pinhole looks along (xd, yd, 1): by Newton's method; NaN where there is none. */
function bentBack(xd: number, yd: number, [k1, k2, p1, p2, k3]: readonly number[]): readonly [number, number] {
  let [x, y] = [xd, yd];
  for (let step = 0; step < STEPS; step++) {
    const square = x * x + y * y;
    const radial = 1 + square * (k1 + square * (k2 + square * k3));
    const slope = 2 * (k1 + square * (2 * k2 + square * 3 * k3));
    const offX = x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x) - xd;
    const offY = y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y - yd;
    const cross = x * y * slope + 2 * p1 * x + 2 * p2 * y;
    const xx = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x;
    const yy = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x;
    const determinant = xx * yy - cross * cross;
    // A ray of the far side of a fold is mirrored.
    if (Math.hypot(offX, offY) < CLOSE) return determinant > 0 && x * xd + y * yd >= 0 ? [x, y] : [NaN, NaN];
    x -= (yy * offX - cross * offY) / determinant;
    y -= (xx * offY - cross * offX) / determinant;
  }
  return [NaN, NaN];
}

type Rays = Readonly<{ width: number; slopes: Float64Array }>;

const KNOWN = new WeakMap<Lens, Rays>();

/** Slopes to the right and down of the ray of each pixel, in turns; kept for each lens. */
export function raysOf(lens: Lens, width: number, height: number): Float64Array {
  const known = KNOWN.get(lens);
  if (known?.width === width && known.slopes.length === 2 * width * height) return known.slopes;
  const { fx, fy, cx, cy, distortion = [] } = lens;
  const bends = distortion.some((each) => each !== 0);
  const slopes = new Float64Array(2 * width * height);
  for (let at = 0; at < slopes.length; at += 2) {
    const [x, y] = [((at / 2) % width) - cx, Math.floor(at / 2 / width) - cy];
    slopes.set(bends ? bentBack(x / fx, y / fy, distortion) : [x / fx, y / fy], at);
  }
  KNOWN.set(lens, { width, slopes });
  return slopes;
}

/** How far along its ray the light of a range turned back: |p| + |p - light| is twice the range; NaN where that is too short. */
export function alongRay(lens: Lens, range_m: number, x: number, y: number, unit: number): number {
  const { light_x_m = 0, light_y_m = 0, light_z_m = 0 } = lens;
  const square = light_x_m ** 2 + light_y_m ** 2 + light_z_m ** 2;
  if (square === 0) return range_m;
  const around = 4 * range_m * range_m - square;
  return around > 0 ? around / (2 * (2 * range_m - unit * (light_x_m * x + light_y_m * y + light_z_m))) : NaN;
}

/** How much a point `along_m` along its ray moves with its range: 1 where the light stands at the lens. */
export function movedBy({ light_x_m = 0, light_y_m = 0, light_z_m = 0 }: Lens, range_m: number, along_m: number): number {
  const square = light_x_m ** 2 + light_y_m ** 2 + light_z_m ** 2;
  return (4 * along_m * (2 * range_m - along_m)) / (4 * range_m * range_m - square);
}
