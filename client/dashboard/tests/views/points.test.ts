import { describe, expect, test } from "vitest";

import { byFlags, byValue, fillCloud, makeCloud } from "../../src/views/points/cloud";

const FIELD_RAD = Math.PI / 2;

describe("a cloud of points", () => {
  test("has each pixel at its range along its ray", () => {
    const cloud = makeCloud(12);
    const range = Float32Array.from({ length: 12 }, (_, pixel) => 1 + pixel);
    expect(fillCloud(cloud, range, 4, FIELD_RAD, () => undefined)).toBe(12);
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
    expect(fillCloud(cloud, range, 3, FIELD_RAD, byValue(new Float32Array([0, 9, 0]), 0, 9, "grey"))).toBe(1);
    expect([...cloud.colours.slice(0, 3)]).toEqual([255, 255, 255]);
    expect(cloud.positions[2]).toBe(-2);
  });

  test("is coloured by the gravest flag", () => {
    const out = new Uint8Array(3);
    byFlags([4 | 1])(0, out, 0);
    expect([...out]).toEqual([0xd5, 0x5e, 0x00]);
  });
});
