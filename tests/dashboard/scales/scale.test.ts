import { describe, expect, test } from "vitest";

import { autoLimits, fraction, histogram, type Scale, symmetric, ticks, valueAt } from "../../../client/dashboard/src/scales/scale";

const linear: Scale = { low: 2, high: 6, kind: "linear" };
const logarithmic: Scale = { low: 1, high: 1000, kind: "logarithmic" };

describe("a place on a scale", () => {
  test("goes evenly between the ends of a linear scale", () =>
    expect([2, 3, 6, 8].map((value) => fraction(linear, value))).toEqual([0, 0.25, 1, 1.5]));

  test("goes by factors on a logarithmic one", () => {
    expect(fraction(logarithmic, 10)).toBeCloseTo(1 / 3);
    expect(fraction(logarithmic, 0)).toBe(0);
    expect(fraction(logarithmic, -4)).toBe(0);
  });

  test("is not a number for what is none", () => {
    expect(fraction(linear, NaN)).toBeNaN();
    expect(fraction(logarithmic, NaN)).toBeNaN();
  });

  test.each([linear, logarithmic, { low: 1, high: 9, kind: "root" } as const, { low: 0, high: 50, kind: "logarithmic" } as const])(
    "leads back to its value on %o",
    (scale) => {
      for (const place of [0, 0.2, 0.7, 1]) expect(fraction(scale, valueAt(scale, place))).toBeCloseTo(place, 9);
    },
  );
});

describe("ticks", () => {
  test("are round numbers within the ends", () => expect(ticks({ low: 0.93, high: 3.41, kind: "linear" }, 6)).toEqual([1, 1.5, 2, 2.5, 3]));

  test("reach the ends where these are round", () => {
    const values = ticks({ low: 0, high: 6, kind: "linear" }, 6);
    expect([values[0], values.at(-1)]).toEqual([0, 6]);
  });

  test("of a logarithmic scale are powers of ten, with 2 and 5 where there is room", () => {
    expect(ticks(logarithmic, 6)).toEqual([1, 10, 100, 1000]);
    expect(ticks({ low: 1, high: 50, kind: "logarithmic" }, 6)).toEqual([1, 2, 5, 10, 20, 50]);
  });

  test("of a logarithmic scale within one decade are still some", () =>
    expect(ticks({ low: 1.4, high: 3, kind: "logarithmic" }, 6)).toEqual([1.5, 2, 2.5, 3]));

  test("of an empty scale are none", () => expect(ticks({ low: 1, high: 1, kind: "linear" }, 6)).toEqual([]));
});

describe("limits that follow the data", () => {
  test("hold all of it, at round numbers", () => {
    const { low, high } = autoLimits(null, { low: 1.73, high: 4.21 });
    expect([low, high]).toEqual([1.5, 4.5]);
  });

  test("stand still while noise moves the data a little", () => {
    const first = autoLimits(null, { low: 1.73, high: 4.21 });
    expect(autoLimits(first, { low: 1.69, high: 4.3 })).toBe(first);
  });

  test("move when the data leaves them, and when it no longer needs them", () => {
    const first = autoLimits(null, { low: 1.73, high: 4.21 });
    expect(autoLimits(first, { low: 1.73, high: 5.2 }).high).toBeGreaterThanOrEqual(5.2);
    expect(autoLimits(first, { low: 2.0, high: 2.4 }).high).toBeLessThan(3);
  });

  test("do not go below zero for what is never negative", () => {
    expect(autoLimits(null, { low: 0, high: 900 }).low).toBe(0);
    expect(autoLimits(null, { low: -0.2, high: 0.3 }).low).toBeLessThan(-0.19);
  });

  test("survive a frame without a single value", () => {
    const first = autoLimits(null, { low: 1, high: 2 });
    expect(autoLimits(first, { low: NaN, high: NaN })).toBe(first);
    expect(autoLimits(null, { low: NaN, high: NaN })).toEqual({ low: 0, high: 1 });
  });

  test("of a constant picture still have a width", () => {
    const { low, high } = autoLimits(null, { low: 3, high: 3 });
    expect(low).toBeLessThan(3);
    expect(high).toBeGreaterThan(3);
  });
});

test("limits of what is signed lie evenly around zero", () => {
  expect(symmetric({ low: -0.02, high: 0.3 })).toEqual({ low: -0.3, high: 0.3 });
  expect(symmetric({ low: -4, high: -1 })).toEqual({ low: -4, high: 4 });
});

test("a histogram counts every value once, those beyond the ends in the outermost bins, and no NaN", () => {
  const counts = histogram([2, 2.1, 3.9, 6, 5.99, -100, 100, NaN], linear, 4);
  expect([...counts]).toEqual([3, 1, 0, 3]);
  // with a margin of half the scale on either side
  expect([...histogram([0, 2, 4, 6, 8], linear, 4, -0.5, 1.5)]).toEqual([1, 1, 1, 2]);
});
