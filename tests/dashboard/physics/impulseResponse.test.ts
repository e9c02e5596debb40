import { describe, expect, test } from "vitest";

import { impulseResponse, peaks, phasesAround } from "../../../client/dashboard/src/physics/impulseResponse";
import { densityAt } from "../../../client/dashboard/src/physics/maximumEntropy";
import { momentsOf, picture } from "../oracle";

const F_HZ = 23e6;
const TWO_RETURNS = [
  { phase_rad: 1.1, weight: 700 },
  { phase_rad: 3.9, weight: 300 },
];

describe("peaks", () => {
  // The less light is spread evenly, the sharper the peaks: from broad ones to a ten thousandth of a turn.
  test.each([200, 20, 2, 0.2])("stand where the returns are, with their shares, over %d of even light", (uniform) => {
    const c = picture([momentsOf(TWO_RETURNS, uniform, 8)]);
    const [first, second] = peaks(c, 0);
    expect(first.phase_rad).toBeCloseTo(1.1, 2);
    expect(second.phase_rad).toBeCloseTo(3.9, 2);
    const error = 0.02 + uniform / 1000; // even light belongs to no return
    expect(Math.abs(first.share - 0.7)).toBeLessThan(error);
    expect(Math.abs(second.share - 0.3)).toBeLessThan(error);
  });

  test("share all the light among them", () => {
    const c = picture([momentsOf(TWO_RETURNS, 60, 4)]);
    expect(peaks(c, 0).reduce((sum, { share }) => sum + share, 0)).toBeCloseTo(1, 9);
  });

  test("are found across the end of the period", () => {
    const c = picture([momentsOf([{ phase_rad: 2 * Math.PI - 1e-3, weight: 10 }], 0.5, 4)]);
    const [peak] = peaks(c, 0);
    expect(Math.cos(peak.phase_rad + 1e-3)).toBeCloseTo(1, 6);
    expect(peak.share).toBeGreaterThan(0.9);
    expect(peak.time_s).toBeCloseTo(1 / F_HZ, 10);
  });

  test("of one harmonic are one", () => {
    const c = picture([momentsOf([{ phase_rad: 2, weight: 10 }], 5, 1)]);
    expect(peaks(c, 0)).toHaveLength(1);
    expect(peaks(c, 0)[0].share).toBe(1);
  });

  test("do not exist where there is no density", () => {
    const c = picture([momentsOf(TWO_RETURNS, 60, 3)]);
    c.planes[0] = NaN;
    expect(peaks(c, 0)).toEqual([]);
    c.planes[0] = 0;
    expect(peaks(c, 0)).toEqual([]);
  });
});

describe("a sampled impulse response", () => {
  test.each([200, 2, 0.02])("reaches the top of every peak and holds all its light, over %d of even light", (uniform) => {
    const c = picture([momentsOf(TWO_RETURNS, uniform, 8)]);
    const found = peaks(c, 0);
    const { time_s, density } = impulseResponse(c, 0, phasesAround(c, 257, [{ pixel: 0, peaks: found }]));
    for (const peak of found.slice(0, 2)) {
      const nearest = density[time_s.findIndex((t) => Math.abs(t - peak.time_s) < 1e-15)];
      expect(nearest / peak.density).toBeCloseTo(1, 6);
    }
    let light = 0;
    for (let n = 1; n < time_s.length; n++) light += 0.5 * (density[n] + density[n - 1]) * (time_s[n] - time_s[n - 1]);
    expect(light / (1000 + uniform)).toBeCloseTo(1, 1);
  });

  test("rises in time over one period, and is Eq. (2) at each", () => {
    const c = picture([momentsOf(TWO_RETURNS, 60, 4)]);
    const { time_s, density } = impulseResponse(c, 0, phasesAround(c, 129, [{ pixel: 0, peaks: peaks(c, 0) }]));
    expect(time_s[0]).toBe(0);
    expect(time_s[time_s.length - 1]).toBeCloseTo(1 / F_HZ, 15);
    time_s.slice(1).forEach((t, n) => expect(t).toBeGreaterThanOrEqual(time_s[n]));
    expect(density[40]).toBeCloseTo(densityAt(c, 0, 2 * Math.PI * F_HZ * time_s[40]), -2);
  });
});
