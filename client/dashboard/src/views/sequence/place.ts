/** Where choices of sequences stand in the plot of accuracy against time, both logarithmic. */

import { fraction, type Scale, ticks } from "../../scales/scale";
import { plannedError_m } from "../../store/rangeErrors";
import type { AppliedDocument, ChoiceDocument, FrameMeta, TradeoffDocument } from "../../stream/documents";

export type Ends = Readonly<{ time: Scale; error: Scale }>;

export type Standing = Readonly<{ capture_s: number; range_error_m: number }>;

/** Room around what is shown, as a factor. */
const ROOM = 1.25;

/** Scales, in s and m, that hold the front and the frame beside which it was predicted: what follows trembles, and the axes must not. */
export function endsOf({ front, current }: TradeoffDocument): Ends {
  const times = [current.capture_s, ...front.map(({ capture_s }) => capture_s)];
  const errors = front.map(({ predicted }) => predicted.range_error_m).flatMap(({ low, high, median }) => [low, high ?? low, median]);
  const then = plannedError_m(current.meta.accuracy);
  if (then !== null) errors.push(then);
  const scale = (values: readonly number[]): Scale => ({
    low: Math.min(...values) / ROOM,
    high: Math.max(...values) * ROOM,
    kind: "logarithmic",
  });
  return { time: scale(times), error: scale(errors) };
}

/** Where the camera stands with a sequence: by the frame on screen, or by that which the front was predicted beside, or as predicted. */
export function standingOf(meta: FrameMeta | null, sequence: AppliedDocument, { current, front }: TradeoffDocument): Standing | null {
  const ofIt = [meta, current.meta].find((each) => each?.sequence_id === sequence.sequence_id && plannedError_m(each.accuracy) !== null);
  const predicted = front.find((choice) => FIELDS.every((field) => choice.sequence[field] === sequence[field]));
  const range_error_m = plannedError_m(ofIt?.accuracy ?? null) ?? predicted?.predicted.range_error_m.median ?? null;
  return range_error_m === null ? null : { capture_s: sequence.capture_s, range_error_m };
}

/** What makes two sequences the same, of those that differ in nothing else. */
const FIELDS = ["base_frequency_hz", "harmonics", "zeroth", "exposure_s", "takes"] as const;

/** Place of a choice, 0 to 1 from the left and from the bottom. */
export function placeOf({ time, error }: Ends, capture_s: number, range_error_m: number): { x: number; y: number } {
  return { x: fraction(time, capture_s), y: fraction(error, range_error_m) };
}

/** Round numbers along a scale, with at least this share of it between two. */
export function marksOf(scale: Scale, apart: number): { value: number; place: number }[] {
  const marks: { value: number; place: number }[] = [];
  for (const value of ticks(scale, 6)) {
    const place = fraction(scale, value);
    if (marks.length === 0 || place - marks[marks.length - 1].place >= apart) marks.push({ value, place });
  }
  return marks;
}

/** Where a time stands among the points of a front, in steps from the first: between two by its logarithm. */
export function stepOf(front: readonly ChoiceDocument[], capture_s: number): number {
  const after = front.findIndex((choice) => choice.capture_s >= capture_s);
  if (after <= 0) return after < 0 ? front.length - 1 : 0;
  const [low, high] = [front[after - 1].capture_s, front[after].capture_s];
  return after - 1 + Math.log(capture_s / low) / Math.log(high / low);
}

/** Whether two choices are the same sequence. */
export function sameSequence(a: ChoiceDocument | null, b: ChoiceDocument | null): boolean {
  return a !== null && b !== null && JSON.stringify(a.sequence) === JSON.stringify(b.sequence);
}

/** How far from a point a click may be to mean it, in px. */
const REACH_PX = 30;

/** The point that a click means: the nearest, as points stand closer than fingers are wide; null for none. */
export function nearest<T extends { readonly x: number; readonly y: number }>(points: readonly T[], x: number, y: number): T | null {
  let found: T | null = null;
  let least = REACH_PX;
  for (const point of points) {
    const distance = Math.hypot(point.x - x, point.y - y);
    if (distance < least) [found, least] = [point, distance];
  }
  return found;
}
