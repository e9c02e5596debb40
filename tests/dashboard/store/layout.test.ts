import { describe, expect, test } from "vitest";

import {
  below,
  beside,
  closed,
  isLayout,
  LAYOUTS,
  type Layout,
  OVERVIEW,
  replaced,
  split,
  viewsOf,
} from "../../../client/dashboard/src/store/layout";

describe("a layout", () => {
  test("is accepted back from the shelf, and nothing else is", () => {
    for (const layout of Object.values(LAYOUTS)) expect(isLayout(JSON.parse(JSON.stringify(layout)))).toBe(true);
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
      [{ share: 1, slots: [{ share: 1, slots: [] }] }],
      [{ share: 1, slots: [{ share: 1, slots: [{ share: 1, slots: [slot] }] }] }],
      [{ share: 1, slots: [slot, { share: 1, slots: [slot] }] }],
    ]) {
      expect(isLayout(broken)).toBe(false);
    }
  });

  test("changes two views' places where one takes the other's", () =>
    expect(viewsOf(replaced(OVERVIEW, "map", "sequence"))).toEqual(["transient", "sequence", "response", "map"]));

  test("shows another view where one stood", () => {
    const two = closed(closed(OVERVIEW, "sequence"), "response");
    expect(two).toEqual([
      {
        share: 1,
        slots: [
          { view: "transient", share: 13 },
          { view: "map", share: 7 },
        ],
      },
    ]);
    expect(viewsOf(replaced(two, "map", "response"))).toEqual(["transient", "response"]);
  });

  test("gives a view that comes to the place of a flat one no less than the mean of its stack", () => {
    const flat: Layout = [
      {
        share: 1,
        slots: [
          {
            share: 1,
            slots: [
              { view: "map", share: 5 },
              { view: "sequence", share: 1 },
            ],
          },
        ],
      },
    ];
    expect(replaced(flat, "sequence", "points")[0].slots).toEqual([
      {
        share: 1,
        slots: [
          { view: "map", share: 5 },
          { view: "points", share: 3 },
        ],
      },
    ]);
  });

  test("keeps its last view", () => {
    const one = ["map", "transient", "sequence", "response"].reduce(closed, OVERVIEW);
    expect(viewsOf(one)).toEqual(["response"]);
  });

  test("takes a view beside another in half of its width", () => {
    const two = closed(closed(OVERVIEW, "sequence"), "response");
    expect(beside(two, "map", "response")?.[0].slots.map(({ share }) => share)).toEqual([13, 3.5, 3.5]);
    // beside a whole stack
    expect(beside(OVERVIEW, "map", "points")?.[0].slots.map(({ share }) => share)).toEqual([13, 3.5, 3.5]);
  });

  test("takes a view below another in half of its height, or in a row of its own where the row is the other's", () => {
    const two = closed(closed(OVERVIEW, "sequence"), "response");
    const stacked = below(two, "map", "response") ?? [];
    expect(stacked[0].slots[1]).toEqual({
      share: 7,
      slots: [
        { view: "map", share: 3.5 },
        { view: "response", share: 3.5 },
      ],
    });
    expect(viewsOf(below(OVERVIEW, "response", "points") ?? [])).toEqual(["transient", "map", "response", "points", "sequence"]);
    expect(below(below(OVERVIEW, "response", "points") ?? [], "map", "streak")).toBeNull(); // four are enough
    const one = closed(two, "map");
    expect(below(one, "transient", "response")?.map(({ slots }) => slots.length)).toEqual([1, 1]);
  });

  test("lets a splitter share the space of its two neighbours, and no panel vanish", () => {
    const parts = [{ share: 1 }, { share: 2 }, { share: 5 }];
    expect(split(parts, 0, 0.5).map(({ share }) => share)).toEqual([1.5, 1.5, 5]);
    const [first, second] = split(parts, 0, -3);
    expect(first.share).toBeGreaterThan(0.1);
    expect(first.share + second.share).toBeCloseTo(3, 12);
  });
});
