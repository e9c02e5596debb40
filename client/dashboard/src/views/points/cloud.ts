/** A range map as points in space: written into the arrays of a geometry, nothing allocated a frame. */
import { type ColourMapName, rgbaOf } from "../../scales/colourMaps";
import type { Scale } from "../../scales/scale";
import { gravest } from "../../ui/flags";
import { picker } from "../../ui/paint";

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

/** A pinhole camera, in pixels: a pixel looks along ((x - cx) / fx, (y - cy) / fy, 1), y down; centres are whole numbers. */
export interface Pinhole {
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
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

/** Writes the points of a range map, range along each pixel's ray; returns how many have one. */
export function fillCloud(cloud: Cloud, range_m: ArrayLike<number>, width: number, { fx, fy, cx, cy }: Pinhole): number {
  const height = range_m.length / width;
  let at = 0;
  for (let y = 0, pixel = 0; y < height; y++) {
    const up = (cy - y) / fy;
    for (let x = 0; x < width; x++, pixel++) {
      const range = range_m[pixel];
      if (!Number.isFinite(range)) continue;
      const right = (x - cx) / fx;
      const depth = range / Math.sqrt(1 + right * right + up * up);
      cloud.positions[at] = right * depth;
      cloud.positions[at + 1] = up * depth;
      cloud.positions[at + 2] = -depth;
      cloud.pixels[at / 3] = pixel;
      at += 3;
    }
  }
  return at / 3;
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
