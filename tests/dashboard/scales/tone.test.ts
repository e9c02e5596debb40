import { describe, expect, test } from "vitest";

import { backdropGrey, strength, TONES, toned, toneIndex } from "../../../client/dashboard/src/scales/tone";

describe.each(TONES)("the %s tone", (kind) => {
  test("goes from dark to white and no further", () => expect([0, 1, 40, -1].map((share) => toned(kind, share))).toEqual([0, 1, 1, 0]));

  test("shows more light brighter", () => {
    const places = [0.002, 0.02, 0.2, 0.9].map((share) => toned(kind, share));
    expect([...places].sort((a, b) => a - b)).toEqual(places);
  });
});

test("the logarithmic tone shows three decades", () => {
  expect(toned("logarithmic", 0.001)).toBeCloseTo(0);
  expect(toned("logarithmic", 0.1)).toBeCloseTo(2 / 3);
});

test("the shader knows the tones by their order", () => expect(TONES.map(toneIndex)).toEqual([0, 1, 2]));

test("light adds nothing to the scene where there is none, and its full colour where it is bright", () =>
  expect([strength(0), strength(1)]).toEqual([0, 1]));

test("a scene that was not measured is black", () => {
  expect([NaN, -1, 0].map(backdropGrey)).toEqual([0, 0, 0]);
  expect(backdropGrey(1)).toBe(backdropGrey(50));
});
