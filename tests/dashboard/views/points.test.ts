import { describe, expect, test } from "vitest";

import {
  byFlags,
  byValue,
  colourCloud,
  fieldOfView,
  fillCloud,
  makeCloud,
  pinholeOf,
  pointRows,
} from "../../../client/dashboard/src/views/points/cloud";
import { distanceOf } from "../../../client/dashboard/src/views/points/lens";
import { onScreen, pointUnder } from "../../../client/dashboard/src/views/points/picking";
import { axesLines, floorOf, frustumLines, gridLabels, gridLines } from "../../../client/dashboard/src/views/points/room";

const WIDE_RAD = Math.PI / 2;

describe("a cloud of points", () => {
  test("has each pixel at its range along its ray", () => {
    const cloud = makeCloud(12);
    const range = Float32Array.from({ length: 12 }, (_, pixel) => 1 + pixel);
    expect(fillCloud(cloud, range, 4, pinholeOf(4, 3, WIDE_RAD))).toBe(12);
    for (let pixel = 0; pixel < 12; pixel++) {
      const [x, y, z] = cloud.positions.slice(3 * pixel, 3 * pixel + 3);
      expect(Math.hypot(x, y, z)).toBeCloseTo(range[pixel], 5);
      // 90 degrees across: half the width of four pixels away, the ray leaves by half a pixel's middle
      expect(x / -z).toBeCloseTo(((pixel % 4) - 1.5) / 2, 5);
      expect(y / -z).toBeCloseTo((1 - Math.floor(pixel / 4)) / 2, 5);
    }
  });

  test("leaves out pixels without a range, and keeps the colours of the others with them", () => {
    const cloud = makeCloud(3);
    const range = new Float32Array([NaN, 2, Infinity]);
    expect(fillCloud(cloud, range, 3, pinholeOf(3, 1, WIDE_RAD))).toBe(1);
    colourCloud(cloud, 1, byValue(new Float32Array([0, 9, 0]), { low: 0, high: 9, kind: "linear" }, "grey"));
    expect(cloud.pixels[0]).toBe(1);
    expect([...cloud.colours.slice(0, 3)]).toEqual([255, 255, 255]);
    expect(cloud.positions[2]).toBe(-2);
  });

  test("follows the lens where it is known", () => {
    const cloud = makeCloud(1);
    fillCloud(cloud, new Float32Array([3]), 1, { fx: 2, fy: 4, cx: -1, cy: -4 });
    // right by 1/2, down by 1, for each 1 ahead: 3 m along (1, 2, 2) / 3
    expect([...cloud.positions]).toEqual([1, -2, -2].map((each) => expect.closeTo(each, 6)));
    expect(fieldOfView(4, pinholeOf(4, 3, 1.2))).toBeCloseTo(1.2, 12);
  });

  test("follows a lens that bends, and light from aside", () => {
    const [k1, k2, p1, p2, k3] = [0.09, -0.27, 0.001, -0.002, 0.09];
    const light = [0.3, -0.1, 0.05];
    const lens = {
      ...{ fx: 365, fy: 366, cx: 255.5, cy: 206.2, distortion: [k1, k2, p1, p2, k3] },
      ...{ light_x_m: light[0], light_y_m: light[1], light_z_m: light[2] },
    };
    const cloud = makeCloud(512 * 424);
    const range = new Float32Array(512 * 424).fill(2);
    const count = fillCloud(cloud, range, 512, lens);
    expect(count).toBe(range.length);
    for (let at = 0; at < count; at += 997) {
      const point = [cloud.positions[3 * at], -cloud.positions[3 * at + 1], -cloud.positions[3 * at + 2]];
      const [x, y] = [point[0] / point[2], point[1] / point[2]];
      const square = x * x + y * y;
      const radial = 1 + k1 * square + k2 * square ** 2 + k3 * square ** 3;
      const column = 365 * (x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x)) + 255.5;
      const row = 366 * (y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y) + 206.2;
      expect([column, row]).toEqual([at % 512, Math.floor(at / 512)].map((each) => expect.closeTo(each, 3)));
      const away = Math.hypot(...point.map((value, axis) => value - light[axis]));
      expect(Math.hypot(...point) + away).toBeCloseTo(4, 5);
    }
    // a path that is shorter than the way to the light
    expect(fillCloud(cloud, new Float32Array([0.1]), 1, lens)).toBe(0);
  });

  test("is handed out as the camera sees it: x right, y down, z ahead", () => {
    const cloud = makeCloud(2);
    const count = fillCloud(cloud, new Float32Array([3, NaN]), 2, { fx: 2, fy: 4, cx: -1, cy: -4 });
    expect(pointRows(cloud, count, 1, { range_m: [3, NaN], direct_dn: [7, 8] })).toEqual([
      ["column_px", "row_px", "x_m", "y_m", "z_m", "range_m", "direct_dn"],
      [0, 0, ...[1, 2, 2].map((each) => expect.closeTo(each, 6)), 3, 7],
    ]);
  });

  test("is coloured by the gravest flag", () => {
    const out = new Uint8Array(3);
    byFlags([4 | 1])(0, out, 0);
    expect([...out]).toEqual([0xe6, 0x9f, 0x00]);
  });
});

describe("the distance of two pins", () => {
  const lens = { fx: 100, fy: 100, cx: 50, cy: 40 };

  test("is that of their points in space", () => {
    // both 4 m ahead: one on the axis, one 3 m to the right
    const a = { x: 50, y: 40, range_m: 4, error_m: 0 };
    const b = { x: 125, y: 40, range_m: 5, error_m: 0 };
    expect(distanceOf(lens, a, b).distance_m).toBeCloseTo(3, 5);
    expect(distanceOf(lens, b, a).distance_m).toBeCloseTo(3, 5);
  });

  test.each([{}, { light_x_m: 0.6, light_z_m: -0.1 }, { light_y_m: 2, distortion: [0.1, -0.2, 0.01, 0.02, 0.05] }])(
    "has the deviation that small changes of the ranges give it: %o",
    (aside) => {
      const camera = { ...lens, ...aside };
      const a = { x: 10, y: 70, range_m: 2.5, error_m: 0.01 };
      const b = { x: 90, y: 20, range_m: 4.1, error_m: 0.02 };
      const apart = (da: number, db: number): number =>
        distanceOf(camera, { ...a, range_m: a.range_m + da }, { ...b, range_m: b.range_m + db }).distance_m;
      const step = 1e-2;
      const byA = (apart(step, 0) - apart(-step, 0)) / (2 * step);
      const byB = (apart(0, step) - apart(0, -step)) / (2 * step);
      expect(distanceOf(camera, a, b).error_m).toBeCloseTo(Math.hypot(byA * 0.01, byB * 0.02), 5);
    },
  );
});

describe("the room around a cloud", () => {
  /** A box of points: 3 m wide, floor 1.2 m below the camera, 2 to 5 m ahead. */
  const box = (noise = 0): Float32Array => {
    const points: number[] = [];
    for (let n = 0; n < 1000; n++)
      points.push(-1.4 + (2.8 * (n % 10)) / 9, -1.2 + noise + (2 * (Math.floor(n / 10) % 10)) / 9, -2 - (2.9 * Math.floor(n / 100)) / 9);
    return Float32Array.from(points);
  };

  test("has its floor below nearly all points, and edges at whole metres", () => {
    const points = box();
    points.set([0, -50, -400]); // one that strays
    const floor = floorOf(points, 1000, null);
    expect(floor).toEqual({ y: expect.closeTo(-1.2, 5), step: 0.5, left: -1.5, right: 1.5, far: -5, near: 0 });
    expect(floorOf(points, 0, null)).toBeNull();
  });

  test("stays where it is while the points only tremble, and follows when they move", () => {
    const floor = floorOf(box(), 1000, null);
    expect(floorOf(box(0.05), 1000, floor)).toBe(floor);
    expect(floorOf(box(0.3), 1000, floor)?.y).toBeCloseTo(-0.9, 5);
  });

  test("has lines a step apart, with their distance from the camera", () => {
    const floor = { y: -1, step: 1, left: -1, right: 2, far: -3, near: 0 };
    const lines = gridLines(floor);
    expect(lines).toHaveLength(6 * (4 + 4));
    for (let n = 0; n < lines.length; n += 6) {
      expect([lines[n + 1], lines[n + 4]]).toEqual([-1, -1]);
      expect(Math.hypot(lines[n + 3] - lines[n], lines[n + 5] - lines[n + 2])).toBe(3);
    }
    expect(gridLabels(floor).map(({ value_m }) => value_m)).toEqual([3, 2, 1]);
    expect(axesLines(floor).filter((value) => value !== 0)).toHaveLength(3);
  });

  test("has the field of view along the rays of the corners of the picture", () => {
    const lens = { fx: 100, fy: 50, cx: 79.5, cy: 59.5 };
    const lines = frustumLines({ y: -1, step: 1, left: -1, right: 1, far: -5, near: 0 }, 160, 120, lens);
    expect(lines).toHaveLength(4 * 12);
    const [x, y, z] = lines.slice(3, 6);
    expect(x / -z).toBeCloseTo(-80 / 100, 6);
    expect(y / -z).toBeCloseTo(60 / 50, 6);
  });
});

describe("the point under the pointer", () => {
  // an eye at 0 that looks along -z, 90 degrees: x / -z from -1 to 1 across a screen of 200 px
  const matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.02, 0];
  const points = new Float32Array([0.5, 0, -1, 1, 0, -2, 0, 0, -4, 0, 0, 4]);

  test("is found where it is on the screen", () => {
    expect(onScreen(matrix, 0.5, 0.25, -1, 200, 100)).toEqual({ x: 150, y: 37.5, depth: 1 });
    expect(onScreen(matrix, 0, 0, 4, 200, 100)).toBeNull();
    expect(pointUnder(points, 4, matrix, 200, 100, { x: 101, y: 49 })).toBe(2);
  });

  test("is the foremost of several, and none where there is none", () => {
    expect(pointUnder(points, 4, matrix, 200, 100, { x: 150, y: 50 })).toBe(0);
    expect(pointUnder(points.slice(3), 3, matrix, 200, 100, { x: 150, y: 50 })).toBe(0);
    expect(pointUnder(points, 4, matrix, 200, 100, { x: 20, y: 50 })).toBeNull();
    expect(pointUnder(points, 1, matrix, 200, 100, { x: 100, y: 50 })).toBeNull();
  });
});
