import { expect, test } from "vitest";

import { neighbour } from "../../../client/dashboard/src/ui/ActionMenu";

const ENTRIES = ["Picture (PNG)", "Range in m (NPY)", "Close"];

test("arrow keys lead from entry to entry, around the ends", () => {
  expect(neighbour(ENTRIES, 0, "ArrowDown")).toBe(1);
  expect(neighbour(ENTRIES, 2, "ArrowDown")).toBe(0);
  expect(neighbour(ENTRIES, 0, "ArrowUp")).toBe(2);
  expect([neighbour(ENTRIES, 1, "Home"), neighbour(ENTRIES, 1, "End")]).toEqual([0, 2]);
});

test("a letter leads to the next entry that begins with it, and other keys nowhere", () => {
  expect(neighbour(ENTRIES, 0, "c")).toBe(2);
  expect(neighbour(ENTRIES, 0, "p")).toBe(0);
  expect(neighbour(ENTRIES, 0, "x")).toBeNull();
  for (const key of ["Enter", " ", "Escape", "Tab"]) expect(neighbour(ENTRIES, 0, key)).toBeNull();
});
