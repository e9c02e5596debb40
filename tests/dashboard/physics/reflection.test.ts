import { describe, expect, test } from "vitest";

import { boundsAt, pixelOf, poissonKernel, RADIUS } from "../../../client/dashboard/src/physics/reflection";
import { boundsOf, momentsOf, picture } from "../oracle";

const RETURNS = [
  { phase_rad: 1.1, weight: 700 },
  { phase_rad: 3.9, weight: 300 },
];
const PHASES = [0, 0.6, 1.1, 2.4, 3.9, 5.5];

describe("a pixel's recursion backwards", () => {
  test.each([1, 3, 4, 8])("finds the moments that its coefficients were made of, m = %d", (m) => {
    const b = momentsOf(RETURNS, 60, m);
    const pixel = pixelOf(picture([b]), 0);
    b.forEach(({ re, im }, j) => {
      expect(Math.abs((pixel?.moments[2 * j] ?? NaN) - re)).toBeLessThan(0.05);
      expect(Math.abs((pixel?.moments[2 * j + 1] ?? NaN) - im)).toBeLessThan(0.05);
    });
  });

  test("says that a pixel without a density has none", () => {
    const c = picture([momentsOf(RETURNS, 60, 3)]);
    for (const nothing of [NaN, 0, -1]) {
      c.planes[0] = nothing;
      expect(pixelOf(c, 0)).toBeNull();
    }
  });
});

describe("bounds", () => {
  test.each([1, 3, 4, 8])("are those of the dense solve, m = %d", (m) => {
    const b = momentsOf(RETURNS, 60, m);
    const pixel = pixelOf(picture([b]), 0);
    if (pixel === null) throw new Error("There is a density.");
    for (const phase_rad of PHASES) {
      const expected = boundsOf(b, phase_rad, RADIUS);
      const found = boundsAt(pixel, phase_rad);
      expect(found.lower / expected.lower).toBeCloseTo(1, 3);
      expect(found.upper / expected.upper).toBeCloseTo(1, 3);
    }
  });

  test("hold the estimate and the light that the moments are of", () => {
    const pixel = pixelOf(picture([momentsOf(RETURNS, 60, 4)]), 0);
    if (pixel === null) throw new Error("There is a density.");
    for (let phase_rad = 0; phase_rad < 6.28; phase_rad += 0.05) {
      const { lower, upper, smoothed } = boundsAt(pixel, phase_rad);
      const real = RETURNS.reduce((sum, each) => sum + each.weight * poissonKernel(phase_rad - each.phase_rad), 60 / (2 * Math.PI));
      const slack = 1e-4 * upper;
      for (const value of [smoothed, real]) {
        expect(value).toBeGreaterThan(lower - slack);
        expect(value).toBeLessThan(upper + slack);
      }
    }
  });
});
