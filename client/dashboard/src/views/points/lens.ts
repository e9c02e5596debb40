/** Where pixels look: as the service says, or by a field of view that is assumed. */
import { DEGREE } from "../../physics/constants";
import type { Pixel } from "../../store/pixel";
import { aNumber, type Setting } from "../../store/settings";
import type { Store } from "../../store/store";
import type { IntrinsicsDocument } from "../../stream/documents";
import { fillCloud, makeCloud, pinholeOf } from "./cloud";
import { type Lens, movedBy } from "./rays";

/** What the service knows of the lens; null where it only assumes. */
export function knownLens({ camera }: Store): IntrinsicsDocument | null {
  const lens = camera.value?.intrinsics;
  return lens === undefined || lens.source === "assumed" ? null : lens;
}

/** Fields of view that a camera may have, across, in degrees. */
export const FIELDS_DEG = aNumber(5, 150);
/** Used where the service does not know where its camera looks. */
export const FIELD_DEG: Setting<number> = { key: "points.field_deg", initial: 45, ...FIELDS_DEG };

/** The lens for pictures of a size. */
export function lensOf(store: Store, width: number, height: number): Lens {
  const lens = knownLens(store);
  return lens !== null && lens.width === width && lens.height === height
    ? lens
    : pinholeOf(width, height, store.settings.of(FIELD_DEG).value * DEGREE);
}

/** A pixel with its range and the deviation of that, both in m. */
export type Ranged = Pixel & Readonly<{ range_m: number; error_m: number }>;

/** Distance of what two pixels see, and its standard deviation by that of both ranges, to first order; in m. */
export function distanceOf(lens: Lens, a: Ranged, b: Ranged): { readonly distance_m: number; readonly error_m: number } {
  const [from, to] = [pointAt(lens, a), pointAt(lens, b)];
  const between = from.map((value, axis) => value - to[axis]);
  const distance_m = Math.hypot(...between);
  // A range moves its point along its ray: only what of that lies along the distance changes it.
  const share = (point: readonly number[], range_m: number): number =>
    movedBy(lens, range_m, Math.hypot(...point)) *
    point.reduce((sum, value, axis) => sum + (value / Math.hypot(...point)) * (between[axis] / distance_m), 0);
  return { distance_m, error_m: Math.hypot(share(from, a.range_m) * a.error_m, share(to, b.range_m) * b.error_m) };
}

/** The point that a pixel sees, in m, as `fillCloud` has it. */
export function pointAt(lens: Lens, { x, y, range_m }: Omit<Ranged, "error_m">): number[] {
  const cloud = makeCloud(1);
  // The same ray from a picture of this one pixel.
  fillCloud(cloud, [range_m], 1, { ...lens, cx: lens.cx - x, cy: lens.cy - y });
  return [...cloud.positions];
}
