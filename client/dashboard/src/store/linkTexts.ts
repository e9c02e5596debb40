/** Parts of an address as text, and back: where the views stand, how maps and light are shown, what is pinned. */

import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import { TONES, type ToneKind } from "../scales/tone";
import { isLayout, isStack, type Layout, type Slot, type Stack } from "./layout";
import { type LightChoice, PLAYS, type Play } from "./lightLook";
import { isLimits, type LookChoice } from "./looks";
import { MAP_PRODUCTS } from "./mapCatalogue";
import { PIN_NAMES, type Pin, polygonOf, type Region, regionOf } from "./measures";
import type { Pixel } from "./pixel";
import { VIEW_NAMES } from "./viewNames";
import { type View, WHOLE, windowAt } from "./viewport";

/** A pixel as "81,20". */
export function pixelOf(text: string): Pixel | null {
  const found = /^(\d{1,5}),(\d{1,5})$/.exec(text);
  return found === null ? null : { x: Number(found[1]), y: Number(found[2]) };
}

export function pixelText({ x, y }: Pixel): string {
  return `${x},${y}`;
}

/** A layout as "2:transient.1,2_map.1_points.1/1:response.2": each row's share, then its views with theirs; views of a stack follow its share. */
export function layoutOf(text: string): Layout | null {
  const slotOf = (slot: string): Slot => ({ view: slot.split(".")[0], share: Number(slot.slice(slot.indexOf(".") + 1)) });
  const placeOf = (place: string): Slot | Stack => {
    const [share, ...slots] = place.split("_");
    return slots.length === 0 ? slotOf(place) : { share: Number(share), slots: slots.map(slotOf) };
  };
  const rows = text.split("/").map((row) => {
    const [share, slots = ""] = row.split(":");
    return { share: Number(share), slots: slots.split(",").map(placeOf) };
  });
  return isLayout(rows, VIEW_NAMES) ? rows : null;
}

export function layoutText(layout: Layout): string {
  const short = (share: number): string => String(Number(share.toPrecision(3)));
  const slotText = ({ view, share }: Slot): string => `${view}.${short(share)}`;
  const placeText = (place: Slot | Stack): string => (isStack(place) ? [short(place.share), ...place.slots.map(slotText)].join("_") : slotText(place));
  return layout.map(({ share, slots }) => `${short(share)}:${slots.map(placeText).join(",")}`).join("/");
}

/** Looks as "range,viridis,linear,1,3": product, colours, scale, and limits where these were set. */
export function looksOf(texts: readonly string[]): Record<string, LookChoice> {
  const looks: Record<string, LookChoice> = {};
  for (const text of texts) {
    const [product, colours, kind, ...ends] = text.split(",");
    const limits = ends.length === 2 ? { low: Number(ends[0]), high: Number(ends[1]) } : null;
    const known = MAP_PRODUCTS.some((each) => each.product === product) && (COLOUR_MAPS as readonly string[]).includes(colours);
    if (known && (kind === "linear" || kind === "logarithmic") && isLimits(limits)) looks[product] = { colours: colours as ColourMapName, kind, limits };
  }
  return looks;
}

export function lookText(product: string, { colours, kind, limits }: LookChoice): string {
  const ends = limits === null ? [] : [limits.low, limits.high].map((end) => Number(end.toPrecision(6)));
  return [product, colours, kind, ...ends].join(",");
}

/** How the light is shown as "gate,inferno,root,0,scene": what of it, colours, tone, stops, and whether the scene stands behind it. */
export function lightOf(text: string): LightChoice | null {
  const [play, colours, tone, stops = "", behind] = text.split(",");
  const known = (PLAYS as readonly string[]).includes(play) && (COLOUR_MAPS as readonly string[]).includes(colours) && (TONES as readonly string[]).includes(tone);
  if (!known || !/^-?\d{1,2}$/.test(stops) || (behind !== "scene" && behind !== "black")) return null;
  return { play: play as Play, colours: colours as ColourMapName, tone: tone as ToneKind, stops: Number(stops), backdrop: behind === "scene" };
}

export function lightText({ play, colours, tone, stops, backdrop }: LightChoice): string {
  return [play, colours, tone, stops, backdrop ? "scene" : "black"].join(",");
}

/** Pins as "A30,40/B120,70". */
export function pinsOf(text: string): readonly Pin[] {
  return text.split("/").flatMap((each) => {
    const [name, place] = [PIN_NAMES.find((known) => each.startsWith(known)), pixelOf(each.slice(1))];
    return name === undefined || place === null ? [] : [{ name, ...place }];
  });
}

export function pinsText(pins: readonly Pin[]): string {
  return pins.map((pin) => pin.name + pixelText(pin)).join("/");
}

/** A region as its two corners, "50,40/69,54", or as three or more of a polygon. */
export function partOf(text: string): Region | null {
  const corners = text
    .split("/")
    .map(pixelOf)
    .filter((corner) => corner !== null);
  if (corners.length < 2 || corners.length > MOST_CORNERS) return null;
  return corners.length === 2 ? regionOf(corners[0], corners[1]) : polygonOf(corners);
}

const MOST_CORNERS = 32;

export function partText({ x0, y0, x1, y1, corners }: Region): string {
  return (
    corners ?? [
      { x: x0, y: y0 },
      { x: x1, y: y1 },
    ]
  )
    .map(pixelText)
    .join("/");
}

/** The part of the picture that is in sight as "4,0.25,0.1": how many times larger, its left and top end in shares. */
export function viewOf(text: string): View | null {
  const numbers = text.split(",").map(Number);
  return numbers.length === 3 && numbers.every(Number.isFinite) && numbers[0] > 1 ? windowAt(numbers[0], numbers[1], numbers[2]) : null;
}

/** "" of the whole picture. */
export function viewText(view: View): string {
  return view === WHOLE ? "" : [view.zoom, view.left, view.top].map((each) => Number(each.toPrecision(4))).join(",");
}
