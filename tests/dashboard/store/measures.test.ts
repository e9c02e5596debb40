import { describe, expect, test } from "vitest";
import { figuresOf, holds, Measures, polygonOf, regionOf } from "../../../client/dashboard/src/store/measures";
import { Settings } from "../../../client/dashboard/src/store/settings";

describe("pins", () => {
  test("take the first free name, and are let go by pinning them again", () => {
    const measures = new Measures(new Settings(null));
    for (const x of [1, 2, 3]) measures.pin({ x, y: 0 });
    measures.pin({ x: 2, y: 0 });
    measures.pin({ x: 9, y: 9 });
    expect(measures.pins.value).toEqual([
      { name: "A", x: 1, y: 0 },
      { name: "B", x: 9, y: 9 },
      { name: "C", x: 3, y: 0 },
    ]);
  });

  test("of which there are three already give up the last", () => {
    const measures = new Measures(new Settings(null));
    for (const x of [1, 2, 3, 4]) measures.pin({ x, y: 0 });
    expect(measures.pins.value.map(({ name, x }) => `${name}${x}`)).toEqual(["A1", "B2", "C4"]);
  });
});

describe("a region", () => {
  test("lies between its corners, whichever was first", () =>
    expect(regionOf({ x: 5, y: 1 }, { x: 2, y: 8 })).toEqual({ x0: 2, y0: 1, x1: 5, y1: 8 }));

  test("has mean, deviation and count of the pixels that have a value", () => {
    // 4 x 3; the region is the 2 x 2 in its middle, one pixel without a value
    const map = [99, 99, 99, 99, 99, 2, 4, 99, 99, NaN, 6, 99];
    const { mean, std, count, pixels, values } = figuresOf(map, 4, 3, { x0: 1, y0: 1, x1: 2, y1: 2 });
    expect([mean, std, count, pixels]).toEqual([4, 2, 3, 4]);
    expect([...values]).toEqual([2, 4, 6]);
  });

  test("within a polygon holds what is drawn: a notch is outside, edges are inside, whichever way round", () => {
    // each # is a pixel whose centre lies within or on an edge of the arrow head
    const drawn = ["#.......#", "##.....##", "###...###", "####.####", ".#######.", "..#####..", "...###...", "....#...."];
    const corners = [
      { x: 0, y: 0 },
      { x: 4, y: 4 },
      { x: 8, y: 0 },
      { x: 8, y: 3 },
      { x: 4, y: 7 },
      { x: 0, y: 3 },
    ];
    for (const way of [corners, [...corners].reverse(), [...corners.slice(2), ...corners.slice(0, 2)]]) {
      const region = polygonOf(way);
      if (region === null) throw new Error("there are corners");
      expect(region).toMatchObject({ x0: 0, y0: 0, x1: 8, y1: 7 });
      expect(drawn.map((row, y) => [...row].map((_, x) => (holds(region, x, y) ? "#" : ".")).join(""))).toEqual(drawn);
      expect(figuresOf(new Float32Array(9 * 8).fill(5), 9, 8, region)).toMatchObject({
        mean: 5,
        std: 0,
        count: drawn.join("").split("#").length - 1,
      });
    }
  });

  test("grows by corners, each taken away by setting it again, and takes the place of a rectangle", () => {
    const measures = new Measures(new Settings(null));
    measures.region.value = regionOf({ x: 0, y: 0 }, { x: 9, y: 9 });
    const [a, b, c] = [
      { x: 1, y: 1 },
      { x: 5, y: 1 },
      { x: 1, y: 4 },
    ];
    for (const corner of [a, b, c]) measures.corner(corner);
    expect(measures.region.value).toEqual({ x0: 1, y0: 1, x1: 5, y1: 4, corners: [a, b, c] });
    measures.corner(b);
    expect(measures.region.value).toEqual({ x0: 1, y0: 1, x1: 1, y1: 4, corners: [a, c] });
    expect(figuresOf(new Float32Array(60), 10, 6, measures.region.value as never).count).toBe(4); // the line between the two
    for (const corner of [a, c]) measures.corner(corner);
    expect(measures.region.value).toBeNull();
  });

  test("keeps millimetres on metres, and ends at the edge of a smaller picture", () => {
    const { std, pixels } = figuresOf([1000.001, 1000.003], 2, 1, { x0: 0, y0: 0, x1: 50, y1: 50 });
    expect(std).toBeCloseTo(Math.SQRT2 * 1e-3, 6);
    expect(pixels).toBe(2);
  });

  test("without a value has no mean; with one, no deviation", () => {
    expect(figuresOf([NaN], 1, 1, { x0: 0, y0: 0, x1: 0, y1: 0 })).toMatchObject({ mean: NaN, std: NaN, count: 0 });
    expect(figuresOf([3], 1, 1, { x0: 0, y0: 0, x1: 0, y1: 0 })).toMatchObject({ mean: 3, std: NaN, count: 1 });
  });
});
