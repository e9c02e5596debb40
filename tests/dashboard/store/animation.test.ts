import { effect, signal } from "@preact/signals";
import { expect, test } from "vitest";

import { AnimationLoop } from "../../../client/dashboard/src/store/animation";

/** A display that refreshes on command. */
function display(): { loop: AnimationLoop; refresh: (now_ms: number) => void; waiting: () => number } {
  const requested: ((now_ms: number) => void)[] = [];
  const loop = new AnimationLoop((callback) => requested.push(callback));
  const refresh = (now_ms: number): void => {
    for (const callback of requested.splice(0)) callback(now_ms);
  };
  return { loop, refresh, waiting: () => requested.length };
}

test("it sleeps until it is woken, and again when no step wants more", () => {
  const { loop, refresh, waiting } = display();
  let left = 2;
  loop.add(() => --left > 0);
  expect(waiting()).toBe(0);
  loop.wake();
  loop.wake();
  expect(waiting()).toBe(1);
  refresh(0);
  refresh(16);
  expect(left).toBe(0);
  expect(waiting()).toBe(0);
});

test("steps receive the time that passed, but not that of a sleep", () => {
  const { loop, refresh } = display();
  const elapsed: number[] = [];
  loop.add((elapsed_s) => elapsed.push(elapsed_s) % 3 !== 0);
  loop.wake();
  [1000, 1016, 1032].forEach(refresh);
  loop.wake();
  [9000, 9020].forEach(refresh);
  expect(elapsed.map((seconds) => Math.round(1000 * seconds))).toEqual([0, 16, 16, 0, 20]);
});

test("what several steps change is drawn once", () => {
  const { loop, refresh } = display();
  const [a, b] = [signal(0), signal(0)];
  let drawn = 0;
  effect(() => {
    drawn += 1 + 0 * (a.value + b.value);
  });
  loop.add(() => {
    a.value += 1;
    return false;
  });
  loop.add(() => {
    b.value += 1;
    return false;
  });
  loop.wake();
  refresh(0);
  expect(drawn).toBe(2); // once at first, once for both
});
