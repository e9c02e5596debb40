import { describe, expect, test } from "vitest";

import { BINS, paintStreak, Streak, whiteOf } from "../../../client/dashboard/src/views/streak/streak";
import { momentsOf, picture } from "../oracle";

const pixel = (phase_rad: number) => momentsOf([{ phase_rad, weight: 100 }], 1, 4);

describe("a streak image", () => {
  const c = picture([pixel(1), pixel(2), pixel(3), pixel(4)], 2);

  test("holds all light of its row, each pixel's brightest when its light comes", () => {
    const streak = new Streak();
    streak.compute(c, 1);
    for (const [x, phase_rad] of [
      [0, 3],
      [1, 4],
    ] as const) {
      const column = Array.from({ length: BINS }, (_, bin) => streak.values[2 * bin + x]);
      const light = column.reduce((sum, value) => sum + value, 0) / (BINS * c.baseFrequency_hz);
      expect(light).toBeCloseTo(101, 2);
      expect(column.indexOf(Math.max(...column))).toBe(Math.floor((phase_rad / (2 * Math.PI)) * BINS));
    }
  });

  test("forgets a row when another is chosen", () => {
    const [moved, fresh] = [new Streak(), new Streak()];
    moved.compute(c, 0);
    moved.compute(c, 1);
    fresh.compute(c, 1);
    expect([...moved.values]).toEqual([...fresh.values]);
  });

  test("is clear where there is no density and bright where it is white", () => {
    const rgba = new Uint8ClampedArray(12);
    paintStreak(new Float32Array([NaN, 0, 5]), 5, "linear", "grey", rgba);
    expect([...rgba]).toEqual([0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 255]);
    expect(whiteOf(new Float32Array([NaN, 0]))).toBeNaN();
    expect(whiteOf(Float32Array.from({ length: 1000 }, (_, n) => n))).toBeCloseTo(994, -1);
  });
});
