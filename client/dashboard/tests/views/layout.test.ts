import { describe, expect, test } from "vitest";

import { below, beside, closed, isLayout, LAYOUTS, OVERVIEW, replaced, split, viewsOf } from "../../src/views/layout";
import { VIEW_NAMES } from "../../src/views/names";

describe("a layout", () => {
  test("is accepted back from the shelf, and nothing else is", () => {
    for (const layout of Object.values(LAYOUTS)) expect(isLayout(JSON.parse(JSON.stringify(layout)), VIEW_NAMES)).toBe(true);
    const slot = { view: "map", share: 1 };
    for (const broken of [
      null,
      [],
      [{ share: 1, slots: [] }],
      [{ share: 0, slots: [slot] }],
      [{ share: 1, slots: [{ view: "gone", share: 1 }] }],
      [{ share: 1, slots: [slot, slot] }],
      [null],
      [{ share: 1, slots: [null] }],
    ]) {
      expect(isLayout(broken, VIEW_NAMES)).toBe(false);
    }
  });

  test("changes two views' places where one takes the other's", () => {
    expect(viewsOf(replaced(OVERVIEW, "map", "sequence"))).toEqual(["sequence", "transient", "response", "map"]);
  });

  test("shows another view where one stood", () => {
    const two = closed(closed(OVERVIEW, "sequence"), "response");
    expect(two).toHaveLength(1);
    expect(viewsOf(replaced(two, "map", "response"))).toEqual(["response", "transient"]);
  });

  test("keeps its last view", () => {
    const one = ["map", "transient", "sequence", "response"].reduce(closed, OVERVIEW);
    expect(viewsOf(one)).toEqual(["response"]);
  });

  test("takes a view beside another in half of its width, and below it in a row of its own", () => {
    const two = closed(closed(OVERVIEW, "sequence"), "response");
    expect(beside(two, "map", "response")?.[0].slots.map(({ share }) => share)).toEqual([1, 1, 3]);
    expect(below(two, "map", "response")?.map(({ slots }) => slots.length)).toEqual([2, 1]);
  });

  test("lets a splitter share the space of its two neighbours, and no panel vanish", () => {
    const parts = [{ share: 1 }, { share: 2 }, { share: 5 }];
    expect(split(parts, 0, 0.5).map(({ share }) => share)).toEqual([1.5, 1.5, 5]);
    const [first, second] = split(parts, 0, -3);
    expect(first.share).toBeGreaterThan(0.1);
    expect(first.share + second.share).toBeCloseTo(3, 12);
  });
});
