import { expect, test } from "vitest";

import { PICTURES, turnsOf } from "../../src/views/transient/strip";

test("a strip's times lie evenly where light arrives", () => {
  const arrivals = new Float32Array(100);
  arrivals.fill(1, 20, 60);
  arrivals[90] = 0.01;
  const turns = turnsOf(arrivals);
  expect(turns).toHaveLength(PICTURES);
  expect(turns[0]).toBeCloseTo(0.225, 6);
  expect(turns[PICTURES - 1]).toBeCloseTo(0.575, 6);
});

test("without light they lie over the whole period", () => {
  const turns = turnsOf(new Float32Array(10), 5);
  for (const [n, turn] of turns.entries()) expect(turn).toBeCloseTo(0.1 + 0.2 * n, 12);
});
