/** A range map as points in space: written into the arrays of a geometry, nothing allocated a frame. */
import { type Plane, planeThrough } from "../../physics/plane";
import { type ColourMapName, rgbaOf } from "../../scales/colourMaps";
import type { Scale } from "../../scales/scale";
import { holds, type Region } from "../../store/measures";
import type { Rows } from "../../ui/download";
import { gravest } from "../../ui/flags";
import { picker } from "../../ui/paint";
import { alongRay, type Lens, type Pinhole, raysOf } from "./rays";

export interface Cloud {
  /** x to the right, y up, z towards the viewer, in m: the camera stands at 0 and looks along -z. */
  readonly positions: Float32Array;
  /** RGB bytes. */
  readonly colours: Uint8Array;
  /** Which pixel of the picture each point is of. */
  readonly pixels: Uint32Array;
}

/** Writes the RGB of a pixel into an array of bytes at an index. */
export type Painter = (pixel: number, out: Uint8Array, at: number) => void;

export function makeCloud(pixels: number): Cloud {
  return { positions: new Float32Array(3 * pixels), colours: new Uint8Array(3 * pixels), pixels: new Uint32Array(pixels) };
}

/** Square pixels around the axis; the field of view is horizontal. */
export function pinholeOf(width: number, height: number, fieldOfView_rad: number): Pinhole {
  const focal = width / (2 * Math.tan(fieldOfView_rad / 2));
  return { fx: focal, fy: focal, cx: (width - 1) / 2, cy: (height - 1) / 2 };
}

/** How wide a camera looks, across. */
export function fieldOfView(width: number, { fx }: Pinhole): number {
  return 2 * Math.atan(width / (2 * fx));
}

/** Writes the points of a range map, half of the path of the light; returns how many have one. */
export function fillCloud(cloud: Cloud, range_m: ArrayLike<number>, width: number, lens: Lens): number {
  const rays = raysOf(lens, width, range_m.length / width);
  let at = 0;
  for (let pixel = 0; pixel < range_m.length; pixel++) {
    const [right, down] = [rays[2 * pixel], rays[2 * pixel + 1]];
    const unit = 1 / Math.sqrt(1 + right * right + down * down);
    const depth = unit * alongRay(lens, range_m[pixel], right, down, unit);
    if (!Number.isFinite(depth)) continue;
    cloud.positions[at] = right * depth;
    cloud.positions[at + 1] = -down * depth;
    cloud.positions[at + 2] = -depth;
    cloud.pixels[at / 3] = pixel;
    at += 3;
  }
  return at / 3;
}

/** The first `count` points as a table, in the camera's own axes, x right, y down, z ahead, with other values of their pixels by name. */
export function pointRows(
  { positions, pixels }: Cloud,
  count: number,
  width: number,
  values: Readonly<Record<string, ArrayLike<number>>>,
): Rows {
  const places = Array.from({ length: count }, (_, n) => {
    const [x_m, up_m, back_m] = positions.subarray(3 * n, 3 * n + 3);
    return [pixels[n] % width, Math.floor(pixels[n] / width), x_m, -up_m, -back_m, ...Object.values(values).map((of) => of[pixels[n]])];
  });
  return [["column_px", "row_px", "x_m", "y_m", "z_m", ...Object.keys(values)], ...places];
}

/** Colours the first `count` points. */
export function colourCloud({ pixels, colours }: Cloud, count: number, paint: Painter): void {
  for (let n = 0; n < count; n++) paint(pixels[n], colours, 3 * n);
}

/** Colours by a value, as a map on this scale has them. */
export function byValue(values: ArrayLike<number>, scale: Scale, colours: ColourMapName): Painter {
  const pick = picker(scale, colours);
  return (pixel, out, at) => writeRgb(pick(values[pixel]), out, at);
}

/** Colours as a picture of RGBA pixels has them. */
export function byPicture(pixels: Uint32Array): Painter {
  return (pixel, out, at) => writeRgb(pixels[pixel], out, at);
}

function writeRgb(rgba: number, out: Uint8Array, at: number): void {
  out[at] = rgba & 255;
  out[at + 1] = (rgba >> 8) & 255;
  out[at + 2] = (rgba >> 16) & 255;
}

const VALID = "#96a0aa";
const REASONS = Uint32Array.from({ length: 256 }, (_, bits) => rgbaOf((gravest(bits)?.colour ?? VALID).slice(1)));

/** Colours by the gravest flag. */
export function byFlags(flags: ArrayLike<number>): Painter {
  return (pixel, out, at) => writeRgb(REASONS[flags[pixel] & 255], out, at);
}

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
