import { signal } from "@preact/signals";
import { describe, expect, test } from "vitest";

import type { Frame } from "../../src/store/frames";
import { colourTable } from "../../src/ui/colourMaps";
import { MAP_PRODUCTS } from "../../src/views/map/catalogue";
import { MapLook } from "../../src/views/map/limits";
import { paint } from "../../src/views/map/paint";

describe("a painted map", () => {
  test("has the colour of each value, and none where there is no value", () => {
    const rgba = new Uint8ClampedArray(20);
    paint([0, 1, 2, NaN, 99], { low: 0, high: 2, kind: "linear" }, "viridis", rgba);
    const table = colourTable("viridis");
    const colour = (level: number): number[] => [...table.slice(4 * level, 4 * level + 4)];
    const pixels = [0, 1, 2, 3, 4].map((pixel) => [...rgba.slice(4 * pixel, 4 * pixel + 4)]);
    expect(pixels).toEqual([colour(0), colour(128), colour(255), [0, 0, 0, 0], colour(255)]);
  });
});

describe("the look of a map", () => {
  const frame = (low: number, high: number): Frame => ({ map: { low, high, valid: 1 } }) as Frame;

  test("follows the data until limits are set, and again when they are taken away", () => {
    const newest = signal<Frame | null>(frame(1, 4));
    const look = new MapLook(MAP_PRODUCTS[0], newest, null);
    const followed = look.scale.value;
    expect(followed.low).toBeLessThanOrEqual(1);
    expect(followed.high).toBeGreaterThanOrEqual(4);
    look.manual.value = { low: 2, high: 3 };
    expect(look.scale.value).toMatchObject({ low: 2, high: 3 });
    newest.value = frame(0, 6);
    expect(look.scale.value).toMatchObject({ low: 2, high: 3 });
    look.manual.value = null;
    expect(look.scale.value.high).toBeGreaterThanOrEqual(6);
  });

  test("is the same value for a frame like the last", () => {
    const newest = signal<Frame | null>(frame(1, 4));
    const look = new MapLook(MAP_PRODUCTS[0], newest, null);
    const before = look.scale.value;
    newest.value = frame(1.01, 3.99);
    expect(look.scale.value).toBe(before);
  });
});
