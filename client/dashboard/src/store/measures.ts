/** What is measured in the pictures by hand: pixels that are kept, and a region. */
import type { Signal } from "@preact/signals";
import { statistics } from "../physics/statistics";

import type { PlanRequest } from "../stream/documents";
import { type Pixel, pixelOf, pixelText } from "./pixel";
import type { Settings } from "./settings";

/** The names of pins, and their colours in all views: distinct for colour-blind eyes too (after Okabe and Ito). */
export const PIN_NAMES = ["A", "B", "C"] as const;
export const PIN_COLOURS: Readonly<Record<PinName, string>> = { A: "#e69f00", B: "#56b4e9", C: "#cc79a7" };
export type PinName = (typeof PIN_NAMES)[number];

/** A pixel that is kept, and what somebody wrote there. */
export type Pin = Pixel & Readonly<{ name: PinName; note?: string }>;
export const LONGEST_NOTE = 80;

/** A rectangle of pixels, both corners included; `x0` and `y0` are not larger than `x1` and `y1`. */
export interface Region {
  readonly x0: number;
  readonly y0: number;
  readonly x1: number;
  readonly y1: number;
  /** Corners of a polygon in the rectangle, in their order: only the pixels within it belong to the region, and those on its edges. */
  readonly corners?: readonly Pixel[];
}

/** Corners of a polygon that a link may say. */
const MOST_CORNERS = 32;

/** Half the width of a region that is made around a pixel by a key. */
const REACH = 10;

export class Measures {
  readonly pins: Signal<readonly Pin[]>;
  readonly region: Signal<Region | null>;

  constructor(settings: Settings) {
    // As "A30,40/B120,70,edge", a note without what would end it.
    this.pins = settings.of<readonly Pin[]>({
      link: "pins",
      initial: [],
      text: (pins) => pins.map((pin) => pin.name + pixelText(pin) + (pin.note ? `,${twice(pin.note)}` : "")).join("/"),
      parse: (text) => {
        const pins = text.split("/").flatMap((each) => {
          const [x, y, written = ""] = each.slice(1).split(",");
          const [name, place] = [PIN_NAMES.find((known) => each.startsWith(known)), pixelOf(`${x},${y}`)];
          if (name === undefined || place === undefined) return [];
          return [{ name, ...place, ...(written === "" ? {} : { note: read(written).slice(0, LONGEST_NOTE) }) }];
        });
        return pins.length === 0 ? undefined : pins;
      },
    });
    // As its two corners, "50,40/69,54", or as three or more of a polygon.
    this.region = settings.of<Region | null>({
      link: "region",
      initial: null,
      text: (region) => {
        if (region === null) return "";
        const { x0, y0, x1, y1, corners } = region;
        return corners?.map(pixelText).join("/") ?? `${x0},${y0}/${x1},${y1}`;
      },
      parse: (text) => {
        const corners = text.split("/").flatMap((corner) => pixelOf(corner) ?? []);
        if (corners.length < 2 || corners.length > MOST_CORNERS) return undefined;
        return corners.length === 2 ? regionOf(corners[0], corners[1]) : polygonOf(corners);
      },
    });
  }

  /** Keeps a pixel under the first free name, the last name where none is free; a pixel that is kept already is let go. */
  pin({ x, y }: Pixel): void {
    const pins = this.pins.peek();
    const others = pins.filter((pin) => pin.x !== x || pin.y !== y);
    if (others.length < pins.length) {
      this.pins.value = others;
      return;
    }
    const name = PIN_NAMES.find((each) => !pins.some((pin) => pin.name === each)) ?? PIN_NAMES[PIN_NAMES.length - 1];
    this.pins.value = [...pins.filter((pin) => pin.name !== name), { name, x, y }].sort((a, b) => a.name.localeCompare(b.name));
  }

  /** Writes something at a pin. */
  annotate(name: PinName, note: string): void {
    this.pins.value = this.pins.peek().map((pin) => (pin.name === name ? { ...pin, note: note.slice(0, LONGEST_NOTE) } : pin));
  }

  /** What is written at pins, by their names and pixels. */
  get notes(): Readonly<Record<string, string>> {
    return Object.fromEntries(this.pins.value.flatMap((pin) => (pin.note ? [[`${pin.name} (${pin.x}, ${pin.y})`, pin.note]] : [])));
  }

  /** Adds a corner to the polygon, or takes it away where it is one already; a rectangle gives way to a new polygon. */
  corner({ x, y }: Pixel): void {
    const corners = this.region.peek()?.corners ?? [];
    const others = corners.filter((corner) => corner.x !== x || corner.y !== y);
    this.region.value = polygonOf(others.length < corners.length ? others : [...corners, { x, y }]);
  }

  /** The region around a pixel of a picture; none where there is one. */
  toggleRegion({ x, y }: Pixel, width: number, height: number): void {
    if (this.region.peek() !== null) this.region.value = null;
    else
      this.region.value = regionOf(
        { x: Math.max(0, x - REACH), y: Math.max(0, y - REACH) },
        { x: Math.min(width - 1, x + REACH), y: Math.min(height - 1, y + REACH) },
      );
  }
}

/** Text in a part of an address, which is read once as a whole. */
function twice(note: string): string {
  return encodeURIComponent(encodeURIComponent(note));
}

function read(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // no such text
  }
}

/** The region between two corners, in whatever order. */
export function regionOf(a: Pixel, b: Pixel): Region {
  return { x0: Math.min(a.x, b.x), y0: Math.min(a.y, b.y), x1: Math.max(a.x, b.x), y1: Math.max(a.y, b.y) };
}

/** A region as the service is asked for it: a box, or the corners of a polygon; null for the whole picture. */
export function askedRegion(region: Region | null): NonNullable<PlanRequest["region"]> | null {
  if (region === null) return null;
  const { x0, y0, x1, y1, corners } = region;
  return corners === undefined || corners.length < 3 ? [x0, y0, x1 - x0 + 1, y1 - y0 + 1] : corners.map(({ x, y }) => [x, y] as const);
}

/** The region within a polygon; null without corners. */
export function polygonOf(corners: readonly Pixel[]): Region | null {
  if (corners.length === 0) return null;
  const [xs, ys] = [corners.map(({ x }) => x), corners.map(({ y }) => y)];
  return { x0: Math.min(...xs), y0: Math.min(...ys), x1: Math.max(...xs), y1: Math.max(...ys), corners };
}

/** Whether a pixel of the rectangle belongs to the region: the polygon's edges cross the row to its right an odd number of times, or run through its centre. */
export function holds({ corners }: Region, x: number, y: number): boolean {
  if (corners === undefined) return true;
  let odd = false;
  for (let n = 0; n < corners.length; n++) {
    const [a, b] = [corners[n], corners[(n + 1) % corners.length]];
    // Of whole numbers, and exact.
    const side = (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    if (side === 0 && between(x, a.x, b.x) && between(y, a.y, b.y)) return true;
    if (a.y > y !== b.y > y && side > 0 === b.y > a.y) odd = !odd;
  }
  return odd;
}

function between(value: number, one: number, other: number): boolean {
  return Math.min(one, other) <= value && value <= Math.max(one, other);
}

/** Figures of the values within a region. */
export interface RegionFigures {
  /** Mean and standard deviation (with N - 1) of the pixels that have a value; NaN where too few have one. */
  readonly mean: number;
  readonly std: number;
  /** How many have a value, and of how many. */
  readonly count: number;
  readonly pixels: number;
  readonly values: Float64Array;
}

/** The values of a map (height, width) within a region, and their figures. */
export function figuresOf(map: ArrayLike<number>, width: number, height: number, region: Region): RegionFigures {
  const values: number[] = [];
  let pixels = 0;
  for (let y = region.y0; y <= Math.min(region.y1, height - 1); y++) {
    for (let x = region.x0; x <= Math.min(region.x1, width - 1); x++) {
      if (!holds(region, x, y)) continue;
      pixels += 1;
      const value = map[y * width + x];
      if (Number.isFinite(value)) values.push(value);
    }
  }
  return { ...statistics(values), count: values.length, pixels, values: Float64Array.from(values) };
}
