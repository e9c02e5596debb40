import { describe, expect, test } from "vitest";

import { rangeOfTime_m } from "../../../client/dashboard/src/physics/constants";
import { densityAt } from "../../../client/dashboard/src/physics/maximumEntropy";
import { cis, complex, densityOf, momentsOf, mul, picture } from "../oracle";

const F_HZ = 23e6;
const TWO_RETURNS = [
  { phase_rad: 1.1, weight: 700 },
  { phase_rad: 3.9, weight: 300 },
];

describe("the density of Eq. (2)", () => {
  test.each([1, 3, 4, 8, 16])("agrees with a dense solve of the moment problem at m = %i", (m) => {
    const b = momentsOf(TWO_RETURNS, 60, m);
    const c = picture([b]);
    for (let n = 0; n < 97; n++) {
      const phase_rad = (2 * Math.PI * n) / 97;
      const expected = 2 * Math.PI * F_HZ * densityOf(b, phase_rad);
      expect(Math.abs(densityAt(c, 0, phase_rad) / expected - 1)).toBeLessThan(1e-4);
    }
  });

  test("is the Poisson kernel for one harmonic", () => {
    const [radius, centre_rad] = [0.7, 2.0];
    const c = picture([[complex(1), mul(complex(radius), cis(centre_rad))]]);
    for (const phase_rad of [0, 1, 2, 3, 6]) {
      const kernel = (1 - radius ** 2) / (1 - 2 * radius * Math.cos(phase_rad - centre_rad) + radius ** 2);
      expect(densityAt(c, 0, phase_rad)).toBeCloseTo(F_HZ * kernel, -2);
    }
  });

  test.each([3, 4, 8])("has the moments it was made from at m = %i", (m) => {
    const b = momentsOf(TWO_RETURNS, 60, m);
    const c = picture([b]);
    const count = 40_000;
    for (let j = 0; j <= m; j++) {
      let [re, im] = [0, 0];
      for (let n = 0; n < count; n++) {
        const phase_rad = (2 * Math.PI * n) / count;
        const light = densityAt(c, 0, phase_rad) / (F_HZ * count); // of a small part of the period
        re += light * Math.cos(j * phase_rad);
        im += light * Math.sin(j * phase_rad);
      }
      expect(Math.hypot(re - b[j].re, im - b[j].im)).toBeLessThan(0.05); // of b_0 = 1060
    }
  });
});

test("the range of a time of flight is half the way light goes in it", () => {
  expect(rangeOfTime_m(1 / F_HZ)).toBeCloseTo(6.517, 3); // the paper's unambiguous range at 23 MHz
});
