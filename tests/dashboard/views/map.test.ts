import { signal } from "@preact/signals";
import { describe, expect, test } from "vitest";

import { beyond, colourTable } from "../../../client/dashboard/src/scales/colourMaps";
import type { Comparison } from "../../../client/dashboard/src/store/comparison";
import { type Frame, Frames } from "../../../client/dashboard/src/store/frames";
import { Look, Looks } from "../../../client/dashboard/src/store/looks";
import { MAP_PRODUCTS } from "../../../client/dashboard/src/store/mapCatalogue";
import { Settings } from "../../../client/dashboard/src/store/settings";
import { drawn, onBar } from "../../../client/dashboard/src/ui/ColourBar";
import { typed } from "../../../client/dashboard/src/ui/LimitFields";
import { grey, paint } from "../../../client/dashboard/src/ui/paint";

describe("a painted map", () => {
  test("has the colour of each value, another beyond either end, and none where there is no value", () => {
    const rgba = new Uint8ClampedArray(24);
    paint([0, 1, 2, NaN, 99, -1], { low: 0, high: 2, kind: "linear" }, "viridis", rgba);
    const table = colourTable("viridis");
    const colour = (level: number): number[] => [...table.slice(4 * level, 4 * level + 4)];
    const pixels = [0, 1, 2, 3].map((pixel) => [...rgba.slice(4 * pixel, 4 * pixel + 4)]);
    expect(pixels).toEqual([colour(0), colour(128), colour(255), [0, 0, 0, 0]]);
    const { under, over } = beyond("viridis");
    expect([...new Uint32Array(rgba.buffer, 16)]).toEqual([over, under]);
    expect(new Set([over, under, ...new Uint32Array(table.buffer)]).size).toBe(new Set(new Uint32Array(table.buffer)).size + 2);
  });
});

describe("a painted difference", () => {
  test("is grey where it lies within its error or has none, and stays clear without a value", () => {
    const rgba = new Uint8ClampedArray(20);
    const values = [2, -2, 0.5, 2, NaN];
    paint(values, { low: -2, high: 2, kind: "linear" }, "coolwarm", rgba);
    const before = [...new Uint32Array(rgba.buffer)];
    grey(values, [1, 1, 1, NaN, 1], rgba);
    const after = [...new Uint32Array(rgba.buffer)];
    expect(after.slice(0, 2)).toEqual(before.slice(0, 2));
    expect(new Set(after.slice(2, 4))).toEqual(new Set([0xff7d7d7d]));
    expect(after[4]).toBe(0);
  });
});

describe("the look of a map", () => {
  const frame = (low: number, high: number): Frame => ({ map: { low, high } }) as Frame;

  test("follows the data until limits are set, and again when they are taken away", () => {
    const newest = signal<Frame | null>(frame(1, 4));
    const look = new Look(MAP_PRODUCTS[0], newest, new Settings(null));
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

  test("spans both frames that are compared", () => {
    const beside = signal<Frame | null>(null);
    const look = new Look(MAP_PRODUCTS[0], signal<Frame | null>(frame(2, 3)), new Settings(null), beside);
    beside.value = frame(NaN, NaN); // nothing in it has a value
    expect(look.scale.value.high).toBeLessThan(4);
    beside.value = frame(1, 9);
    expect(look.scale.value.low).toBeLessThanOrEqual(1);
    expect(look.scale.value.high).toBeGreaterThanOrEqual(9);
  });

  test("is the same value for a frame like the last", () => {
    const newest = signal<Frame | null>(frame(1, 4));
    const look = new Look(MAP_PRODUCTS[0], newest, new Settings(null));
    const before = look.scale.value;
    newest.value = frame(1.01, 3.99);
    expect(look.scale.value).toBe(before);
  });
});

describe("looks", () => {
  const looks = (): Looks => {
    const frames = new Frames();
    const beside = {
      of: () => ({ b: signal(null), difference: signal(null) }),
    } as unknown as Comparison;
    return new Looks(frames, new Settings(null), beside);
  };

  test("that are locked keep the same limits within a unit, and each its own again afterwards", () => {
    const all = looks();
    const [direct, indirect, range] = ["direct", "indirect", "range"].map((product) => all.of(product));
    all.limit(direct, { low: 0, high: 50 });
    expect(indirect.manual.value).toBeNull();
    all.lock(direct, true);
    expect(indirect.manual.value).toEqual({ low: 0, high: 50 });
    all.limit(indirect, { low: 5, high: 40 });
    expect(direct.manual.value).toEqual({ low: 5, high: 40 });
    expect(range.manual.value).toBeNull();
    all.lock(direct, false);
    expect([direct.manual.value, indirect.manual.value]).toEqual([null, null]);
  });
});

describe("typed limits", () => {
  const scale = { low: 1, high: 3 };

  test("are taken with a point or a comma", () => {
    expect(typed(scale, "high", "2.5")).toEqual({ low: 1, high: 2.5 });
    expect(typed(scale, "low", " 1,5 ")).toEqual({ low: 1.5, high: 3 });
  });

  test("that are reversed, empty or no numbers are refused in words", () => {
    expect(typed(scale, "low", "5")).toContain("5 does not lie below 3");
    expect(typed(scale, "high", "")).toContain("no number");
    expect(typed(scale, "high", "three")).toContain("“three” is no number");
  });
});

describe("a handle of the colour bar", () => {
  const scale = { low: 2, high: 6, kind: "linear" } as const;

  test("sets the limit that stands where it was drawn to", () => {
    expect(drawn(scale, "high", onBar(scale, 5)).high).toBeCloseTo(5, 9);
    expect(drawn(scale, "low", onBar(scale, 1.7)).low).toBeCloseTo(1.7, 9); // into the margin
  });

  test("stops before the other one", () => {
    for (const place of [0, 0.5, 1]) {
      for (const end of ["low", "high"] as const) {
        const { low, high } = drawn(scale, end, place);
        expect(high).toBeGreaterThan(low);
      }
    }
  });
});
