import { expect, test } from "vitest";

import { gapsOf, litOf, peaksOf, turnsOf } from "../../../client/dashboard/src/views/transient/arrivals";

const PICTURES = 8;

test("a strip's times lie evenly where light arrives", () => {
  const arrivals = new Float32Array(100);
  arrivals.fill(1, 20, 60);
  arrivals[90] = 0.01;
  const turns = turnsOf(arrivals, PICTURES);
  expect(turns).toHaveLength(PICTURES);
  expect(turns[0]).toBeCloseTo(0.225, 6);
  expect(turns[PICTURES - 1]).toBeCloseTo(0.575, 6);
});

test("a strip shows no time without light, however far apart the light arrives", () => {
  const arrivals = new Float32Array(100);
  arrivals.fill(1, 10, 14);
  arrivals.fill(0.6, 80, 84);
  for (const turn of turnsOf(arrivals, PICTURES)) expect(arrivals[Math.floor(100 * turn)]).toBeGreaterThan(0);
  expect(turnsOf(arrivals, PICTURES).some((turn) => turn > 0.8)).toBe(true);
});

test("without light they lie over the whole period", () => {
  const turns = turnsOf(new Float32Array(10), 5);
  for (const [n, turn] of turns.entries()) expect(turn).toBeCloseTo(0.1 + 0.2 * n, 12);
});

test("light is there from its first to its last arrival, with a little dark around", () => {
  const arrivals = new Float32Array(100);
  arrivals.fill(1, 20, 24);
  arrivals[60] = 0.3;
  expect(litOf(arrivals)).toEqual({ first: expect.closeTo(0.18, 9), last: expect.closeTo(0.63, 9) });
  expect(litOf(new Float32Array(10))).toBeNull();
});

test("gaps are the times without light, before, between and after it", () => {
  const arrivals = new Float32Array(10);
  [arrivals[2], arrivals[3], arrivals[7]] = [1, 0.5, 0.06];
  expect(gapsOf(arrivals)).toEqual([
    { first: 0, last: 0.2 },
    { first: 0.35, last: 0.7 },
    { first: 0.75, last: 1 },
  ]);
  expect(gapsOf(new Float32Array(10))).toEqual([]);
});

test("the end of a strong return's tail is no picture of its own, a weak return is", () => {
  const arrivals = [0, 1, 0.4, 0.12, 0.08, 0.06, 0, 0, 0.08, 0.06];
  expect(gapsOf(arrivals).map(({ first, last }) => [first, last])).toEqual([
    [0, 0.1],
    [0.35, 0.8],
  ]);
});

test("arrivals are marked where most light comes, not where it only trembles", () => {
  const arrivals = Float32Array.from(
    { length: 192 },
    (_, n) => Math.exp(-(((n - 50) / 6) ** 2)) + 0.4 * Math.exp(-(((n - 120) / 8) ** 2)) + 0.01 * Math.cos(2 * n),
  );
  expect(peaksOf(arrivals).map((turn) => Math.round(96 * turn) / 96)).toEqual([25 / 96, 60 / 96]);
  expect(peaksOf(new Float32Array(192))).toEqual([]);
});

test("light that stays in sight shortens the gaps behind it, and no others", () => {
  const arrivals = [0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
  expect(gapsOf(arrivals).map(({ first, last }) => [first, last])).toEqual([
    [0, 0.2],
    [0.25, 0.7],
    [0.75, 1],
  ]);
  expect(gapsOf(arrivals, 0.2).map(({ first, last }) => [first, last])).toEqual([
    [0, 0.2],
    [0.45, 0.7],
  ]);
});
