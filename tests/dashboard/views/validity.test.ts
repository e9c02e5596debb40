import { expect, test } from "vitest";

import { DISTRUST, FLAGS, gravest } from "../../../client/dashboard/src/ui/flags";
import { countReasons, paintReasons, REASONS } from "../../../client/dashboard/src/views/validity/reasons";

test("every bit has one flag", () => expect(FLAGS.map(({ bit }) => bit).sort((a, b) => a - b)).toEqual([1, 2, 4, 8, 16, 32, 64, 128]));

test("a pixel with several flags is shown by the gravest and counted for each", () => {
  expect(gravest(1 | 4)?.name).toBe("saturated");
  const { total, valid, byName } = countReasons(REASONS.flags, new Uint8Array([0, 1, 5, 5]));
  expect([total, valid, byName.biased, byName.saturated, byName.no_signal]).toEqual([4, 1, 3, 2, 0]);
});

test("flags have their colours, and what is valid a grey for its light", () => {
  const rgba = new Uint8ClampedArray(16);
  paintReasons(REASONS.flags, new Uint8Array([4, 0, 0, 0]), new Float32Array([1, 100, 0, 900]), 100, rgba);
  expect([...rgba.slice(0, 4)]).toEqual([0xe6, 0x9f, 0x00, 255]);
  expect([...rgba.slice(4, 8)]).toEqual([221, 221, 221, 255]);
  expect([...rgba.slice(8, 12)]).toEqual([34, 34, 34, 255]);
  expect([...rgba.slice(12)]).toEqual([221, 221, 221, 255]);
});

test("a pixel has one reason not to trust its range, by its code", () => {
  expect(DISTRUST.map(({ bit }) => bit)).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
  const { total, valid, byName } = countReasons(REASONS.trust, new Uint8Array([0, 0, 1, 5, 5]));
  expect([total, valid, byName.no_range, byName.shadow, byName.no_direct_light]).toEqual([5, 2, 1, 2, 0]);
  const rgba = new Uint8ClampedArray(8);
  paintReasons(REASONS.trust, new Uint8Array([4, 0]), null, 1, rgba);
  expect([...rgba]).toEqual([0xd5, 0x5e, 0x00, 255, 166, 166, 166, 255]);
});
