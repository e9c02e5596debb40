import { describe, expect, test } from "vitest";

import type { AppliedDocument, ChoiceDocument, FrameMeta, TradeoffDocument } from "../../../client/dashboard/src/stream/documents";
import { endsOf, marksOf, nearest, placeOf, sameSequence, standingOf, stepOf } from "../../../client/dashboard/src/views/sequence/place";
import { goalWords } from "../../../client/dashboard/src/views/sequence/words";

const choice = (capture_s: number, median: number): ChoiceDocument =>
  ({
    capture_s,
    sequence: { takes: capture_s },
    predicted: { range_error_m: { median, low: 0.9 * median, high: 1.1 * median, p90: 2 * median } },
  }) as unknown as ChoiceDocument;
const TRADEOFF = {
  front: [choice(0.05, 0.04), choice(5, 0.0004)],
  current: { capture_s: 0.09, meta: { accuracy: { range_error_m: 0.03, range_std_m: 0.011, range_bias_m: 0 } } },
} as unknown as TradeoffDocument;

describe("the plot of accuracy against time", () => {
  test("holds the front with its uncertainty and where the camera stands", () => {
    const ends = endsOf({
      ...TRADEOFF,
      current: { capture_s: 20, meta: { accuracy: { range_error_m: 0.5, range_std_m: 0.2, range_bias_m: 0 } } },
    } as unknown as TradeoffDocument);
    for (const [capture_s, range_error_m] of [
      [0.05, 0.044],
      [5, 0.00036],
      [20, 0.2],
    ]) {
      const { x, y } = placeOf(ends, capture_s, range_error_m);
      expect(Math.min(x, y)).toBeGreaterThan(0);
      expect(Math.max(x, y)).toBeLessThan(1);
    }
  });

  test("is logarithmic: equal factors are equal ways", () => {
    const ends = endsOf(TRADEOFF);
    const [a, b, c] = [0.1, 0.4, 1.6].map((capture_s) => placeOf(ends, capture_s, 0.01).x);
    expect(b - a).toBeCloseTo(c - b, 12);
    expect(marksOf(ends.time, 0).map(({ value }) => value)).toContainEqual(expect.closeTo(1, 9));
  });

  test("writes numbers beside its axes only where they have room", () => {
    const { time } = endsOf(TRADEOFF);
    const [all, some] = [marksOf(time, 0), marksOf(time, 0.3)];
    expect(some.length).toBeLessThan(all.length);
    some.slice(1).forEach(({ place }, n) => expect(place - some[n].place).toBeGreaterThanOrEqual(0.3));
  });
});

describe("where the camera stands", () => {
  /** As plans have it: noise and bias together; half of the interval is another figure. */
  const meta = (sequence_id: number, planned_m: number | null): FrameMeta =>
    ({ sequence_id, accuracy: { range_error_m: 1, range_std_m: planned_m, range_bias_m: 0 } }) as unknown as FrameMeta;
  const inUse = (sequence_id: number, takes = 3): AppliedDocument => ({ sequence_id, takes, capture_s: 0.2 }) as AppliedDocument;
  const tradeoff = { ...TRADEOFF, current: { capture_s: 0.09, meta: meta(1, 0.011) } } as unknown as TradeoffDocument;

  test("is taken from the newest frame of the sequence in use", () =>
    expect(standingOf(meta(2, 0.005), inUse(2), tradeoff)).toEqual({ capture_s: 0.2, range_error_m: 0.005 }));

  test("is that of the frame of the prediction where the newest does not tell and the sequence is still the same", () => {
    for (const newest of [null, meta(1, null), meta(0, 0.005)]) expect(standingOf(newest, inUse(1), tradeoff)?.range_error_m).toBe(0.011);
  });

  test("is never taken from a frame of another sequence: it is as predicted, or not known", () => {
    expect(standingOf(meta(1, 0.005), inUse(2, 5), tradeoff)).toEqual({ capture_s: 0.2, range_error_m: 0.0004 });
    expect(standingOf(meta(1, 0.005), inUse(2), tradeoff)).toBeNull();
  });
});

test("two choices are the same where their sequences are", () => {
  expect(sameSequence(choice(1, 2), choice(1, 3))).toBe(true);
  expect(sameSequence(choice(1, 2), choice(2, 2))).toBe(false);
  expect(sameSequence(null, null)).toBe(false);
});

test("a time stands between the points of the front by its logarithm, and not beyond their ends", () => {
  const front = [choice(0.1, 4), choice(0.4, 2), choice(6.4, 1)];
  expect(front.map(({ capture_s }) => stepOf(front, capture_s))).toEqual([0, 1, 2]);
  expect(stepOf(front, 0.2)).toBeCloseTo(0.5, 12);
  expect(stepOf(front, 3.2)).toBeCloseTo(1.75, 12);
  expect([stepOf(front, 0.01), stepOf(front, 60)]).toEqual([0, 2]);
});

test("a click means the nearest point within reach", () => {
  const points = [
    { x: 10, y: 10 },
    { x: 18, y: 10 },
  ];
  expect(nearest(points, 15, 12)).toBe(points[1]);
  expect(nearest(points, 13, 41)).toBeNull();
  expect(nearest(points, 200, 10)).toBeNull();
  expect(nearest([], 0, 0)).toBeNull();
});

test("a goal that cannot be reached is refused in the names and units of the form", () => {
  const detail = "This cannot be reached on this scene: frame_rate_hz = 30. The best frame_rate_hz is 19.94.";
  expect(goalWords({ detail })).toBe(
    "This cannot be reached on this scene: frame rate of 30.0\u202fHz. The best frame rate is 19.9\u202fHz.",
  );
  const off = "This cannot be reached on this scene: range_error_m = 1e-09. The best range_error_m is 0.0015.";
  expect(goalWords({ detail: off })).toBe(
    "This cannot be reached on this scene: error of the range of 1.00\u202fnm. The best error of the range is 1.50\u202fmm.",
  );
  const other = "This cannot be reached on this scene: range_std_m = 0.0001. The best range_std_m is 2.5e-04.";
  expect(goalWords({ detail: other })).toBe(
    "This cannot be reached on this scene: deviation of the range of 100\u202fµm. The best deviation of the range is 250\u202fµm.",
  );
});
