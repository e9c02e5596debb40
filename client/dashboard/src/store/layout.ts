/** Where the views stand: rows of panels and of stacks of panels, each with its share of the space. */
import type { Setting } from "./settings";
import { VIEW_NAMES } from "./viewNames";

export interface Slot {
  readonly view: string;
  /** Share of the row's width, in a stack of its height, relative to its neighbours'. */
  readonly share: number;
}

/** Panels one above the other, in one place of a row. */
export interface Stack {
  /** Share of the row's width. */
  readonly share: number;
  readonly slots: readonly Slot[];
}

export interface Row {
  /** Share of the height, relative to the other rows'. */
  readonly share: number;
  readonly slots: readonly (Slot | Stack)[];
}

export type Layout = readonly Row[];

const MOST_ROWS = 4;
const MOST_SLOTS = 4;
/** No panel shrinks below this share of the two that a splitter moves between. */
const LEAST = 0.12;

const slots = (views: readonly (readonly [string, number])[]): Slot[] => views.map(([view, share]) => ({ view, share }));
const row = (share: number, ...views: readonly (readonly [string, number])[]): Row => ({ share, slots: slots(views) });

/** One picture as large as the window allows, and what belongs to it stacked beside it. */
const hero = (view: string, ...beside: readonly (readonly [string, number])[]): Layout => [
  {
    share: 1,
    slots: [
      { view, share: 13 },
      { share: 7, slots: slots(beside) },
    ],
  },
];

/** Layouts to begin with. */
export const LAYOUTS: Readonly<Record<string, Layout>> = {
  Overview: hero("transient", ["map", 9], ["response", 10], ["sequence", 5]),
  "Six views": [row(1, ["map", 1], ["transient", 1], ["points", 1]), row(1, ["response", 2], ["streak", 1], ["validity", 1])],
  "Two maps": [row(3, ["map", 1], ["second-map", 1]), row(2, ["plots", 1], ["response", 1])],
  Steering: hero("transient", ["map", 8], ["sequence", 9]),
  Laboratory: [row(2, ["map", 1], ["transient", 1]), row(1, ["recordings", 5], ["calibration", 4], ["reconstruction", 3])],
  Simulation: hero("transient", ["simulation", 11], ["map", 9]),
  Projector: hero("transient", ["map", 1], ["points", 1]),
  "One pixel": [row(1, ["transient", 1], ["streak", 1]), row(1, ["response", 1])],
  Space: hero("points", ["map", 9], ["response", 10], ["sequence", 5]),
};

export const OVERVIEW = LAYOUTS.Overview;
/** The same for cameras that see no light in flight. */
export const SPACE = LAYOUTS.Space;

/** Whether a remembered value is a layout of known views, each at most once. */
export function isLayout(value: unknown): value is Layout {
  const share = (part: unknown): boolean => typeof part === "number" && part > 0 && Number.isFinite(part);
  const isSlot = (part: unknown): boolean =>
    isPart(part) && share(part.share) && typeof part.view === "string" && (VIEW_NAMES as readonly string[]).includes(part.view);
  const isGroup = (part: unknown, isInside: (each: unknown) => boolean): boolean =>
    isPart(part) &&
    share(part.share) &&
    Array.isArray(part.slots) &&
    part.slots.length > 0 &&
    part.slots.length <= MOST_SLOTS &&
    part.slots.every(isInside);
  const isPlace = (part: unknown): boolean => isSlot(part) || isGroup(part, isSlot);
  if (!Array.isArray(value) || value.length === 0 || value.length > MOST_ROWS) return false;
  if (!value.every((each) => isGroup(each, isPlace))) return false;
  const views = viewsOf(value as Layout);
  return new Set(views).size === views.length;
}

function isPart(value: unknown): value is Partial<Slot & Stack> {
  return typeof value === "object" && value !== null;
}

/** Whether it is a stack, or a row. */
export function isStack<Stacked extends Row>(part: Slot | Stacked): part is Stacked {
  return "slots" in part;
}

const slotsOf = (part: Slot | Stack): readonly Slot[] => (isStack(part) ? part.slots : [part]);
const holds = (part: Slot | Stack, view: string): boolean => slotsOf(part).some((slot) => slot.view === view);

export function viewsOf(layout: Layout): string[] {
  return layout.flatMap(({ slots }) => slots.flatMap(slotsOf).map(({ view }) => view));
}

/** A layout with its rows' places changed; rows without any vanish. */
function mapped(layout: Layout, change: (place: Slot | Stack) => readonly (Slot | Stack)[]): Layout {
  return layout.map((each) => ({ ...each, slots: each.slots.flatMap(change) })).filter(({ slots }) => slots.length > 0);
}

/** A place with its panels changed; a stack of one is that panel. */
function changed(place: Slot | Stack, change: (slot: Slot) => readonly Slot[]): readonly (Slot | Stack)[] {
  if (!isStack(place)) return change(place);
  const slots = place.slots.flatMap(change);
  return slots.length > 1 ? [{ ...place, slots }] : slots.map((slot) => ({ ...slot, share: place.share }));
}

/** Shows `wanted` where `view` stood; where it stood already the two change places. */
export function replaced(layout: Layout, view: string, wanted: string): Layout {
  return mapped(layout, (place) => {
    // What comes to the place of a flat panel in a stack may need more.
    const least = isStack(place) ? place.slots.reduce((sum, { share }) => sum + share, 0) / place.slots.length : 0;
    return changed(place, (slot) => {
      const shown = slot.view === view ? wanted : slot.view === wanted ? view : slot.view;
      return [shown === slot.view ? slot : { view: shown, share: Math.max(slot.share, least) }];
    });
  });
}

/** The layout without a view; the last one stays. */
export function closed(layout: Layout, view: string): Layout {
  return viewsOf(layout).length === 1 ? layout : mapped(layout, (place) => changed(place, (slot) => (slot.view === view ? [] : [slot])));
}

/** `wanted` to the right of `view`, or of the stack that it stands in, in half of the width; null where the row is full. */
export function beside(layout: Layout, view: string, wanted: string): Layout | null {
  const home = layout.find(({ slots }) => slots.some((place) => holds(place, view)));
  if (home === undefined || home.slots.length >= MOST_SLOTS) return null;
  return mapped(layout, (place) => (holds(place, view) ? halved(place, wanted) : [place]));
}

/** `wanted` below `view`: in a row of its own where `view` has one, else in half of its height; null where there is no room. */
export function below(layout: Layout, view: string, wanted: string): Layout | null {
  const home = layout.find(({ slots }) => slots.some((place) => holds(place, view)));
  const place = home?.slots.find((each) => holds(each, view));
  if (home === undefined || place === undefined) return null;
  if (home.slots.length === 1 && !isStack(place))
    return layout.length >= MOST_ROWS ? null : layout.flatMap((each) => (each === home ? withRowBelow(each, wanted) : [each]));
  if (slotsOf(place).length >= MOST_SLOTS) return null;
  const slots = slotsOf(place).flatMap((slot) => (slot.view === view ? halved(slot, wanted) : [slot]));
  return mapped(layout, (each) => (each === place ? [{ share: place.share, slots }] : [each]));
}

/** A place in half of its room, and a view in the other half. */
function halved<Part extends Slot | Stack>(place: Part, view: string): (Part | Slot)[] {
  const share = place.share / 2;
  return [
    { ...place, share },
    { view, share },
  ];
}

function withRowBelow(above: Row, wanted: string): Row[] {
  return [
    { ...above, share: above.share * 0.6 },
    { share: above.share * 0.4, slots: [{ view: wanted, share: 1 }] },
  ];
}

/**
 * Where the views stand now.
 *
 * As "2:transient.1,2_map.1_points.1/1:response.2": each row's share, then its views with theirs; views of a stack follow its share.
 */
export const LAYOUT: Setting<Layout> = {
  key: "layout",
  link: "layout",
  initial: OVERVIEW,
  accepts: isLayout,
  text: (layout) => {
    const short = (share: number): string => String(Number(share.toPrecision(3)));
    const slotText = ({ view, share }: Slot): string => `${view}.${short(share)}`;
    const placeText = (place: Slot | Stack): string =>
      isStack(place) ? [short(place.share), ...place.slots.map(slotText)].join("_") : slotText(place);
    return layout.map(({ share, slots }) => `${short(share)}:${slots.map(placeText).join(",")}`).join("/");
  },
  parse: (text) => {
    const slotOf = (slot: string): Slot => ({ view: slot.split(".")[0], share: Number(slot.slice(slot.indexOf(".") + 1)) });
    const placeOf = (place: string): Slot | Stack => {
      const [share, ...slots] = place.split("_");
      return slots.length === 0 ? slotOf(place) : { share: Number(share), slots: slots.map(slotOf) };
    };
    const rows = text.split("/").map((row) => {
      const [share, slots = ""] = row.split(":");
      return { share: Number(share), slots: slots.split(",").map(placeOf) };
    });
    return isLayout(rows) ? rows : undefined;
  },
};

/** Two neighbours' shares after the splitter between them stands at `place`, 0 to 1 of both. */
export function split<T extends { readonly share: number }>(parts: readonly T[], at: number, place: number): T[] {
  const both = parts[at].share + parts[at + 1].share;
  const first = both * Math.min(1 - LEAST, Math.max(LEAST, place));
  return parts.map((part, n) => (n === at ? { ...part, share: first } : n === at + 1 ? { ...part, share: both - first } : part));
}
