/** Where the views stand: rows of panels, each with its share of the space. */

export interface Slot {
  readonly view: string;
  /** Share of the row's width, relative to its neighbours'. */
  readonly share: number;
}

export interface Row {
  /** Share of the height, relative to the other rows'. */
  readonly share: number;
  readonly slots: readonly Slot[];
}

export type Layout = readonly Row[];

const MOST_ROWS = 4;
const MOST_SLOTS = 4;
/** No panel shrinks below this share of the two that a splitter moves between. */
const LEAST = 0.12;

const row = (share: number, ...slots: readonly (readonly [string, number])[]): Row => ({
  share,
  slots: slots.map(([view, width]) => ({ view, share: width })),
});

/** Layouts to begin with. */
export const LAYOUTS: Readonly<Record<string, Layout>> = {
  Overview: [row(2, ["map", 2], ["transient", 3]), row(1, ["response", 2], ["sequence", 1])],
  "Six views": [row(1, ["map", 1], ["transient", 1], ["points", 1]), row(1, ["response", 2], ["streak", 1], ["validity", 1])],
  "Two maps": [row(3, ["map", 1], ["second-map", 1]), row(2, ["plots", 1], ["transient", 1])],
  Steering: [row(3, ["map", 1], ["transient", 1]), row(2, ["sequence", 1], ["response", 1])],
  Laboratory: [row(3, ["map", 1], ["transient", 1]), row(2, ["recordings", 5], ["calibration", 4], ["reconstruction", 3])],
  Simulation: [row(1, ["map", 1], ["transient", 1]), row(1, ["simulation", 3], ["sequence", 2])],
  Projector: [row(1, ["map", 1], ["transient", 1])],
  "One pixel": [row(1, ["transient", 1], ["streak", 1]), row(1, ["response", 1])],
  Space: [row(2, ["map", 2], ["points", 3]), row(1, ["response", 2], ["sequence", 1])],
};

export const OVERVIEW = LAYOUTS["Overview"];
/** The same for cameras that see no light in flight. */
export const SPACE = LAYOUTS["Space"];

/** Whether a remembered value is a layout of known views, each at most once. */
export function isLayout(value: unknown, known: readonly string[]): value is Layout {
  if (!Array.isArray(value) || value.length === 0 || value.length > MOST_ROWS) return false;
  const share = (part: unknown): boolean => typeof part === "number" && part > 0 && Number.isFinite(part);
  const views: string[] = [];
  for (const each of value as Partial<Row>[]) {
    const slots: unknown = each?.slots;
    if (!share(each?.share) || !Array.isArray(slots) || slots.length === 0 || slots.length > MOST_SLOTS) return false;
    for (const slot of slots as Partial<Slot>[]) {
      if (!share(slot?.share) || typeof slot.view !== "string" || !known.includes(slot.view)) return false;
      views.push(slot.view);
    }
  }
  return new Set(views).size === views.length;
}

export function viewsOf(layout: Layout): string[] {
  return layout.flatMap(({ slots }) => slots.map(({ view }) => view));
}

function mapped(layout: Layout, change: (slot: Slot) => readonly Slot[]): Layout {
  return layout.map((each) => ({ ...each, slots: each.slots.flatMap(change) })).filter(({ slots }) => slots.length > 0);
}

/** Shows `wanted` where `view` stood; where it stood already the two change places. */
export function replaced(layout: Layout, view: string, wanted: string): Layout {
  return mapped(layout, (slot) => [slot.view === view ? { ...slot, view: wanted } : slot.view === wanted ? { ...slot, view } : slot]);
}

/** The layout without a view; the last one stays. */
export function closed(layout: Layout, view: string): Layout {
  return viewsOf(layout).length === 1 ? layout : mapped(layout, (slot) => (slot.view === view ? [] : [slot]));
}

/** `wanted` to the right of `view`, in half of its place; null where the row is full. */
export function beside(layout: Layout, view: string, wanted: string): Layout | null {
  const home = layout.find(({ slots }) => slots.some((slot) => slot.view === view));
  if (home === undefined || home.slots.length >= MOST_SLOTS) return null;
  return mapped(layout, (slot) => (slot.view === view ? [{ ...slot, share: slot.share / 2 }, { view: wanted, share: slot.share / 2 }] : [slot]));
}

/** `wanted` in a row of its own below that of `view`; null where there is no room for a row. */
export function below(layout: Layout, view: string, wanted: string): Layout | null {
  if (layout.length >= MOST_ROWS || !viewsOf(layout).includes(view)) return null;
  return layout.flatMap((each) =>
    each.slots.some((slot) => slot.view === view)
      ? [{ ...each, share: each.share * 0.6 }, { share: each.share * 0.4, slots: [{ view: wanted, share: 1 }] }]
      : [each],
  );
}

/** Two neighbours' shares after the splitter between them stands at `place`, 0 to 1 of both. */
export function split<T extends { readonly share: number }>(parts: readonly T[], at: number, place: number): T[] {
  const both = parts[at].share + parts[at + 1].share;
  const first = both * Math.min(1 - LEAST, Math.max(LEAST, place));
  return parts.map((part, n) => (n === at ? { ...part, share: first } : n === at + 1 ? { ...part, share: both - first } : part));
}
