import { describe, expect, test } from "vitest";

import { densityAt } from "../../../client/dashboard/src/physics/maximumEntropy";
import { Poles } from "../../../client/dashboard/src/physics/poles";
import { momentsOf, picture } from "../oracle";

const RETURNS = [
  { phase_rad: 1.1, weight: 700 },
  { phase_rad: 3.9, weight: 300 },
];

/** Finds the poles of every pixel. */
function find(poles: Poles, c: ReturnType<typeof picture>): void {
  for (let pixel = 0; pixel < poles.area; pixel++) poles.findOne(c, pixel, pixel);
}

/** The density's integral by many midpoints, in units of b_0. */
function integral(c: ReturnType<typeof picture>, phase_rad: number): number {
  const count = 200_000;
  let sum = 0;
  for (let n = 0; n < count; n++) sum += densityAt(c, 0, ((n + 0.5) / count) * phase_rad);
  return ((sum / count) * phase_rad) / (2 * Math.PI * c.baseFrequency_hz);
}

describe("light up to a time", () => {
  test.each([1, 2, 3, 4, 8])("is the integral of the density, m = %d", (m) => {
    const c = picture([momentsOf(RETURNS, 40, m)]);
    const poles = new Poles(m, 1);
    find(poles, c);
    for (const phase_rad of [0, 0.5, 1.05, 1.1, 1.2, 3, 3.9, 5, 2 * Math.PI]) {
      expect(Math.abs(poles.upTo(0, phase_rad) - integral(c, phase_rad))).toBeLessThan(0.05);
    }
    expect(Math.abs(poles.brightness[0] - 1040)).toBeLessThan(0.05);
  });

  test("is the same from where the poles of another frame stood", () => {
    const [one, other] = [0.4, 0.5].map((shift) =>
      picture([
        momentsOf(
          RETURNS.map((each) => ({ ...each, phase_rad: each.phase_rad + shift })),
          40,
          4,
        ),
      ]),
    );
    const [fresh, warm] = [new Poles(4, 1), new Poles(4, 1)];
    find(fresh, other);
    find(warm, one);
    find(warm, other);
    for (const phase_rad of [0.5, 2, 4, 6]) expect(warm.upTo(0, phase_rad)).toBeCloseTo(fresh.upTo(0, phase_rad), 6);
  });

  test("of even light grows evenly, though its poles all coincide", () => {
    const c = picture([momentsOf([], 100, 4)]);
    const poles = new Poles(4, 1);
    find(poles, c);
    expect(poles.upTo(0, Math.PI)).toBeCloseTo(50, 3);
    expect(poles.upTo(0, 2 * Math.PI)).toBeCloseTo(100, 3);
  });

  test("is not a number where there is no density, and its neighbours' is", () => {
    const c = picture([momentsOf(RETURNS, 40, 3), momentsOf(RETURNS, 40, 3)]);
    c.planes[0] = NaN;
    const poles = new Poles(3, 2);
    find(poles, c);
    const image = new Float32Array(2);
    poles.image(3, image);
    expect(image[0]).toBeNaN();
    expect(image[1]).toBeGreaterThan(600);
  });
});
