import { describe, expect, test } from "vitest";

import { COLOUR_MAPS, colourTable, LEVELS, levelOf } from "../../../client/dashboard/src/scales/colourMaps";

/** CIE lightness of an sRGB colour (IEC 61966-2-1 and CIE 15). */
function lightness(rgb: ArrayLike<number>): number {
  const linear = (byte: number): number => {
    const value = byte / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  };
  const y = 0.2126 * linear(rgb[0]) + 0.7152 * linear(rgb[1]) + 0.0722 * linear(rgb[2]);
  return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
}

const coloursOf = (name: (typeof COLOUR_MAPS)[number]): Uint8ClampedArray[] => {
  const table = colourTable(name);
  return Array.from({ length: LEVELS }, (_, level) => table.slice(4 * level, 4 * level + 4));
};

describe.each(COLOUR_MAPS.filter((name) => name !== "coolwarm"))("%s", (name) => {
  const colours = coloursOf(name);

  test("gets lighter from end to end, so that it reads without seeing colour", () => {
    const values = colours.map(lightness);
    values.slice(1).forEach((value, level) => {
      expect(value).toBeGreaterThan(values[level] - 0.35); // rounding to bytes
    });
    expect(values[LEVELS - 1] - values[0]).toBeGreaterThan(70);
  });
});

describe.each(COLOUR_MAPS)("%s", (name) => {
  const colours = coloursOf(name);

  test("has no steps, and covers what is behind it", () => {
    colours.slice(1).forEach((colour, level) => {
      const jump = Math.max(...[0, 1, 2].map((channel) => Math.abs(colour[channel] - colours[level][channel])));
      expect(jump).toBeLessThanOrEqual(4);
      expect(colour[3]).toBe(255);
    });
  });
});

test("coolwarm is lightest in its middle and gets darker evenly towards both ends", () => {
  const values = coloursOf("coolwarm").map(lightness);
  for (let level = 1; level < 120; level++) expect(values[level]).toBeGreaterThan(values[level - 1] - 0.35);
  for (let level = 137; level < LEVELS; level++) expect(values[level]).toBeLessThan(values[level - 1] + 0.35);
  expect(values[128] - Math.max(values[0], values[255])).toBeGreaterThan(35);
});

test("viridis has the colours it is known by", () => {
  const table = colourTable("viridis");
  expect([...table.slice(0, 3)]).toEqual([68, 1, 84]);
  expect([...table.slice(4 * 255, 4 * 255 + 3)]).toEqual([253, 231, 37]);
});

test("a place on the scale finds its colour, and one beyond the ends the last", () =>
  expect([-1, 0, 0.5, 0.999, 1, 7].map(levelOf)).toEqual([0, 0, 128, 255, 255, 255]));
