/** The plane that a region of the range map is nearest to. */
import { type Plane, planeThrough } from "../../physics/plane";
import { holds, type Region } from "../../store/measures";
import { fillCloud, makeCloud } from "../points/cloud";
import type { Lens } from "../points/rays";

/** The plane through what the pixels of a region see, in m; null where too few have a range. */
export function planeOf(range_m: ArrayLike<number>, width: number, height: number, region: Region, lens: Lens): Plane | null {
  const columns = Math.min(region.x1, width - 1) - region.x0 + 1;
  const rows = Math.min(region.y1, height - 1) - region.y0 + 1;
  if (columns < 1 || rows < 1) return null;
  const inside = Float32Array.from({ length: columns * rows }, (_, at) => {
    const [x, y] = [region.x0 + (at % columns), region.y0 + Math.floor(at / columns)];
    return holds(region, x, y) ? range_m[y * width + x] : NaN;
  });
  const cloud = makeCloud(inside.length);
  const count = fillCloud(cloud, inside, columns, { ...lens, cx: lens.cx - region.x0, cy: lens.cy - region.y0 });
  return planeThrough(cloud.positions.subarray(0, 3 * count));
}
