import { describe, expect, test } from "vitest";
import { History, KEPT_S } from "../../../client/dashboard/src/views/plots/history";
import { profileOf } from "../../../client/dashboard/src/views/plots/profile";
import { planeOf } from "../../../client/dashboard/src/views/points/cloud";

describe("values over time", () => {
  const values = (value: number): ReadonlyMap<string, number> => new Map([["a", value]]);

  test("are kept for the last seconds, and counted back from the newest", () => {
    const history = new History();
    for (let n = 0; n <= 15; n++) history.take(100 + n, values(n));
    const { ago_s, lines } = history.series(["a", "b"]);
    expect(ago_s).toEqual(Array.from({ length: KEPT_S + 1 }, (_, n) => n - KEPT_S));
    expect(lines[0]).toEqual([5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    expect(lines[1]).toEqual(lines[0].map(() => null));
  });

  test("have a mean and a deviation of those that are numbers", () => {
    const history = new History();
    [1, 3, NaN, 5].forEach((value, n) => history.take(n, values(value)));
    expect(history.figures("a")).toEqual({ last: 5, mean: 3, std: 2 });
    expect(history.figures("b")).toEqual({ last: NaN, mean: NaN, std: NaN });
  });

  test("count a frame once, and begin anew where time runs back", () => {
    const history = new History();
    history.take(1, values(1));
    history.take(2, values(2));
    history.take(2, values(9));
    expect(history.series(["a"]).lines[0]).toEqual([1, 9]);
    history.take(0.5, values(4));
    expect(history.series(["a"]).lines[0]).toEqual([4]);
  });
});

describe("a profile", () => {
  // the value at column x and row y is 10 y + x
  const map = Float32Array.from({ length: 60 }, (_, at) => 10 * Math.floor(at / 10) + (at % 10));

  test("has a sample for each column or row that its line crosses", () => {
    const { distance_px, values } = profileOf(map, 10, { x: 1, y: 1 }, { x: 4, y: 5 });
    expect(distance_px).toEqual([0, 1.25, 2.5, 3.75, 5]);
    expect(values).toEqual([11, 22, 33, 43, 54]); // nearest pixels: (1.75, 2), (2.5, 3), (3.25, 4)
  });

  test("runs backwards, over gaps, and may be of one pixel", () => {
    map[22] = NaN;
    expect(profileOf(map, 10, { x: 3, y: 2 }, { x: 1, y: 2 }).values).toEqual([23, null, 21]);
    expect(profileOf(map, 10, { x: 3, y: 2 }, { x: 3, y: 2 }).values).toEqual([23, 23]);
  });
});

describe("the plane of a region", () => {
  test("is that of a wall before the camera, whichever part of it is marked", () => {
    // a wall 2 m ahead, turned by 30 degrees about the vertical: along its ray (r, u, 1) at depth 2 / (1 + r tan 30)
    const lens = { fx: 50, fy: 50, cx: 19.5, cy: 14.5 };
    const range = Float32Array.from({ length: 40 * 30 }, (_, at) => {
      const [right, up] = [((at % 40) - lens.cx) / lens.fx, (lens.cy - Math.floor(at / 40)) / lens.fy];
      return (2 / (1 + right * Math.tan(Math.PI / 6))) * Math.hypot(right, up, 1);
    });
    for (const region of [
      { x0: 2, y0: 3, x1: 12, y1: 9 },
      { x0: 30, y0: 20, x1: 99, y1: 99 },
    ]) {
      const plane = planeOf(range, 40, 30, region, lens);
      expect(Math.acos(Math.abs(plane?.normal[2] ?? 0))).toBeCloseTo(Math.PI / 6, 5);
      expect(plane?.residual).toBeLessThan(1e-6);
    }
    expect(planeOf(range, 40, 30, { x0: 41, y0: 0, x1: 50, y1: 9 }, lens)).toBeNull();
  });
});
