/** What surrounds a cloud: a floor with a grid in metres, and the camera that sees it. Pure: lines as pairs of points, in m. */
import { niceStep } from "../../scales/scale";
import type { Pinhole } from "./rays";

/** A floor, parallel to the camera's own horizontal plane; its edges are whole steps. */
export interface Floor {
  readonly y: number;
  readonly step: number;
  readonly left: number;
  readonly right: number;
  /** Along z, which points towards the viewer: `far` is the lesser. */
  readonly far: number;
  readonly near: number;
}

/** Steps across the longer side, at most. */
const STEPS = 10;
/** Points that the floor is judged by, and their share that may lie below it or beyond its edges. */
const SAMPLE = 1024;
const BEYOND = 0.02;

/** The floor below a cloud: `before` as long as it fits, as noise must not move it; null without points. */
export function floorOf(positions: Float32Array, count: number, before: Floor | null): Floor | null {
  if (count === 0) return null;
  const [x, y, z] = [0, 1, 2].map((axis) => spanOf(positions, count, axis));
  const step = niceStep(Math.max(x.high - x.low, -z.low), STEPS);
  const down = (value: number): number => step * Math.floor(value / step);
  const up = (value: number): number => step * Math.ceil(value / step);
  // From the camera on, so that distances to it are read off.
  const made = {
    y: y.low,
    step,
    left: down(x.low),
    right: Math.max(up(x.high), down(x.low) + step),
    far: Math.min(down(z.low), -step),
    near: 0,
  };
  return before !== null && alike(before, made) ? before : made;
}

function alike(a: Floor, b: Floor): boolean {
  const within = (one: number, other: number, steps: number): boolean => Math.abs(one - other) <= steps * a.step * (1 + 1e-9);
  return a.step === b.step && within(a.y, b.y, 0.2) && within(a.left, b.left, 1) && within(a.right, b.right, 1) && within(a.far, b.far, 1);
}

/** Where nearly all of a sample lie along an axis. */
function spanOf(positions: Float32Array, count: number, axis: number): { low: number; high: number } {
  const values: number[] = [];
  for (let n = 0; n < count; n += Math.max(1, Math.floor(count / SAMPLE))) values.push(positions[3 * n + axis]);
  values.sort((a, b) => a - b);
  const beyond = Math.floor(BEYOND * (values.length - 1));
  return { low: values[beyond], high: values[values.length - 1 - beyond] };
}

const range = (from: number, to: number, step: number): number[] =>
  Array.from({ length: Math.round((to - from) / step) + 1 }, (_, n) => from + n * step);

/** Lines of the grid. */
export function gridLines({ y, step, left, right, far, near }: Floor): Float32Array {
  const across = range(far, near, step).flatMap((z) => [left, y, z, right, y, z]);
  const along = range(left, right, step).flatMap((x) => [x, y, far, x, y, near]);
  return Float32Array.from([...across, ...along]);
}

/** A number that stands somewhere in the room. */
export type Label = Readonly<{ at: readonly [number, number, number]; value_m: number }>;

/** How far lines of the grid are from the camera, beside their right ends. */
export function gridLabels({ y, step, right, far, near }: Floor): Label[] {
  return range(far, near, step)
    .slice(0, -1)
    .map((z) => ({ at: [right, y, z], value_m: -z }));
}

/** Length of the camera's axes, and how far its field of view is drawn, as shares of the floor's length. */
const AXES = 0.08;
const FIELD = 0.16;

/** Half axes from the camera: x to the right, y down, z ahead, as files of the points have them. */
export function axesLines({ far }: Floor): Float32Array {
  const length = -AXES * far;
  return Float32Array.from([0, 0, 0, length, 0, 0, 0, 0, 0, 0, -length, 0, 0, 0, 0, 0, 0, -length]);
}

/** The camera's field of view: from its centre along the corners of the picture, and the picture's frame. */
export function frustumLines({ far }: Floor, width: number, height: number, { fx, fy, cx, cy }: Pinhole): Float32Array {
  const depth = -FIELD * far;
  const corners = [
    [-0.5, -0.5],
    [width - 0.5, -0.5],
    [width - 0.5, height - 0.5],
    [-0.5, height - 0.5],
  ].map(([x, y]) => [((x - cx) / fx) * depth, ((cy - y) / fy) * depth, -depth]);
  return Float32Array.from(corners.flatMap((corner, n) => [0, 0, 0, ...corner, ...corner, ...corners[(n + 1) % 4]]));
}
