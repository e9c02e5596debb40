import { describe, expect, test } from "vitest";

import { byFlags, byValue, fieldOfView, fillCloud, makeCloud, pinholeOf } from "../../src/views/points/cloud";
import { distanceOf } from "../../src/views/points/lens";
import { plyOf } from "../../src/views/points/ply";

const WIDE_RAD = Math.PI / 2;

describe("a cloud of points", () => {
  test("has each pixel at its range along its ray", () => {
    const cloud = makeCloud(12);
    const range = Float32Array.from({ length: 12 }, (_, pixel) => 1 + pixel);
    expect(fillCloud(cloud, range, 4, pinholeOf(4, 3, WIDE_RAD), () => undefined)).toBe(12);
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
    expect(fillCloud(cloud, range, 3, pinholeOf(3, 1, WIDE_RAD), byValue(new Float32Array([0, 9, 0]), { low: 0, high: 9, kind: "linear" }, "grey"))).toBe(1);
    expect([...cloud.colours.slice(0, 3)]).toEqual([255, 255, 255]);
    expect(cloud.positions[2]).toBe(-2);
  });

  test("follows the lens where it is known", () => {
    const cloud = makeCloud(1);
    fillCloud(cloud, new Float32Array([3]), 1, { fx: 2, fy: 4, cx: -1, cy: -4 }, () => undefined);
    // right by 1/2, down by 1, for each 1 ahead: 3 m along (1, 2, 2) / 3
    expect([...cloud.positions]).toEqual([1, -2, -2].map((each) => expect.closeTo(each, 6)));
    expect(fieldOfView(4, pinholeOf(4, 3, 1.2))).toBeCloseTo(1.2, 12);
  });

  test("is handed out as the camera sees it: x right, y down, z ahead", () => {
    const cloud = makeCloud(2);
    const count = fillCloud(cloud, new Float32Array([3, NaN]), 2, { fx: 2, fy: 4, cx: -1, cy: -4 }, byValue([9, 0], { low: 0, high: 9, kind: "linear" }, "grey"));
    const file = plyOf(cloud, count, { fx: 2 });
    const end = "end_header\n";
    const text = new TextDecoder().decode(file);
    const head = text.slice(0, text.indexOf(end) + end.length);
    expect(head.split("\n")).toEqual([
      "ply",
      "format binary_little_endian 1.0",
      'comment {"unit":"m","fx":2}',
      "element vertex 1",
      ..."xyz".split("").map((axis) => `property float ${axis}`),
      ...["red", "green", "blue"].map((colour) => `property uchar ${colour}`),
      "end_header",
      "",
    ]);
    const vertices = new DataView(file.buffer, head.length);
    expect([0, 4, 8].map((at) => vertices.getFloat32(at, true))).toEqual([1, 2, 2].map((each) => expect.closeTo(each, 6)));
    expect([12, 13, 14].map((at) => vertices.getUint8(at))).toEqual([255, 255, 255]);
    expect(vertices.byteLength).toBe(15);
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
    const a = { x: 50, y: 40, range_m: 4, std_m: 0 };
    const b = { x: 125, y: 40, range_m: 5, std_m: 0 };
    expect(distanceOf(lens, a, b).distance_m).toBeCloseTo(3, 5);
    expect(distanceOf(lens, b, a).distance_m).toBeCloseTo(3, 5);
  });

  test("has the deviation that small changes of the ranges give it", () => {
    const a = { x: 10, y: 70, range_m: 2.5, std_m: 0.01 };
    const b = { x: 90, y: 20, range_m: 4.1, std_m: 0.02 };
    const apart = (da: number, db: number): number => distanceOf(lens, { ...a, range_m: a.range_m + da }, { ...b, range_m: b.range_m + db }).distance_m;
    const step = 1e-2;
    const byA = (apart(step, 0) - apart(-step, 0)) / (2 * step);
    const byB = (apart(0, step) - apart(0, -step)) / (2 * step);
    expect(distanceOf(lens, a, b).std_m).toBeCloseTo(Math.hypot(byA * 0.01, byB * 0.02), 4);
  });
});
