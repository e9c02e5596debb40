import { describe, expect, test } from "vitest";

import { planeThrough, tiltOf } from "../../../client/dashboard/src/physics/plane";

/** Points u, v over a square grid in a plane through (1, 2, 3), each lifted off it by `lift`. */
function square(u: number[], v: number[], normal: number[], lift: (x: number, y: number) => number, count = 10): number[] {
  const points: number[] = [];
  for (let y = 0; y < count; y++) {
    for (let x = 0; x < count; x++) {
      for (const axis of [0, 1, 2]) points.push([1, 2, 3][axis] + 0.1 * x * u[axis] + 0.1 * y * v[axis] + lift(x, y) * normal[axis]);
    }
  }
  return points;
}

describe("the plane through points", () => {
  // an orthonormal triple of rational numbers
  const [u, v, normal] = [
    [2 / 3, -2 / 3, 1 / 3],
    [2 / 3, 1 / 3, -2 / 3],
    [1 / 3, 2 / 3, 2 / 3],
  ];

  test("has the points' normal, and the deviation of what stands off it", () => {
    // a checkerboard of +1 and -1 mm: of mean zero and without slope in any direction
    const plane = planeThrough(square(u, v, normal, (x, y) => ((x + y) % 2 === 0 ? 1e-3 : -1e-3)));
    const sign = Math.sign(plane?.normal[2] ?? 0);
    // columns and rows of ten hold the pattern's slope to 1e-3 in 0.3
    for (const axis of [0, 1, 2]) expect(sign * (plane?.normal[axis] ?? 0)).toBeCloseTo(normal[axis], 3);
    expect(plane?.residual).toBeCloseTo(1e-3 * Math.sqrt(100 / 97), 6);
    expect(tiltOf(plane as NonNullable<typeof plane>)).toBeCloseTo(Math.acos(2 / 3), 3);
  });

  test("keeps micrometres on metres", () => {
    const plane = planeThrough(square(u, v, normal, () => 0));
    expect(plane?.residual).toBeLessThan(1e-12);
    expect(planeThrough(square(u, v, normal, (x, y) => ((x * 7 + y * 3) % 5) * 1e-6))?.residual).toBeCloseTo(1.4e-6, 6);
  });

  test("is not there for few points, for points on a line, and for one point many times", () => {
    expect(planeThrough([0, 0, 0, 1, 0, 0, 0, 1, 0])).toBeNull();
    expect(planeThrough(Array.from({ length: 30 }, (_, n) => Math.floor(n / 3) * [0.3, -0.2, 0.9][n % 3]))).toBeNull();
    expect(planeThrough(Array.from({ length: 30 }, () => 2))).toBeNull();
  });

  test.each([
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], 0],
    [[1, 0, 0], [0, 0, 1], [0, 1, 0], Math.PI / 2],
  ])("may stand along the axes: %j %j", (across, down, off, tilt_rad) => {
    const plane = planeThrough(square(across, down, off, () => 0));
    expect(tiltOf(plane as NonNullable<typeof plane>)).toBeCloseTo(tilt_rad, 7);
  });
});
