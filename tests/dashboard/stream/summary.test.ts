import { describe, expect, test } from "vitest";

import { ARRIVAL_TIMES, summariseLight, summariseMap } from "../../../client/dashboard/src/stream/summary";
import { coefficientsOf, momentsOf } from "../oracle";

describe("the summary of a map", () => {
  test("spans the middle 96 percent of the numbers", () => {
    const values = Float32Array.from({ length: 1001 }, (_, n) => n);
    expect(summariseMap(values)).toEqual({ low: 20, high: 980 });
  });

  test("leaves out what is no number", () => {
    const values = Float32Array.from({ length: 100 }, (_, n) => (n % 4 === 0 ? NaN : 5));
    expect(summariseMap(values)).toEqual({ low: 5, high: 5 });
  });

  test("of nothing but missing values says so", () => {
    const { low, high } = summariseMap(new Float32Array(9).fill(NaN));
    expect([low, high]).toEqual([NaN, NaN]);
  });

  test("of a large map is taken from a sample that meets all of it", () => {
    const values = Float32Array.from({ length: 640 * 480 }, (_, n) => n / (640 * 480));
    const { low, high } = summariseMap(values);
    expect(low).toBeCloseTo(0.02, 2);
    expect(high).toBeCloseTo(0.98, 2);
  });
});

describe("the summary of light", () => {
  const [width, height] = [40, 30];
  const phase_rad = 2.2;
  const pixel = coefficientsOf(momentsOf([{ phase_rad, weight: 100 }], 10, 4));
  const planes = new Float32Array(pixel.length * width * height);
  pixel.forEach((value, plane) => planes.fill(value, plane * width * height, (plane + 1) * width * height));
  planes.fill(NaN, 0, 200); // E of some pixels: no light there
  const light = summariseLight({ planes, harmonics: 4, width, height, baseFrequency_hz: 23e6 });

  test("arrives when it does in the pixels", () => {
    const brightest = light.arrivals.indexOf(Math.max(...light.arrivals));
    expect(Math.abs((2 * Math.PI * brightest) / ARRIVAL_TIMES - phase_rad)).toBeLessThan((2 * Math.PI) / ARRIVAL_TIMES);
  });

  test("adds up to the brightness of a lit pixel", () => {
    const step_s = 1 / (23e6 * ARRIVAL_TIMES);
    const total = light.arrivals.reduce((sum, density) => sum + density * step_s, 0);
    expect(total / 110).toBeCloseTo(1, 2);
  });

  test("is metered by its peaks", () => expect(light.peak / Math.max(...light.arrivals)).toBeCloseTo(1, 5));
});
