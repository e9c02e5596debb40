import { describe, expect, test } from "vitest";

import { type Frame, Frames } from "../../../client/dashboard/src/store/frames";
import { FEWEST, Noise, Noises, WINDOW } from "../../../client/dashboard/src/store/noise";

const frame = (values: readonly number[], sequence_id = 1, origin = "/frames/latest"): Frame =>
  ({
    values: Float32Array.from(values),
    shape: [1, values.length],
    meta: { sequence_id, calibration_id: "nominal" },
    origin,
  }) as unknown as Frame;

/** Numbers of a generator, so that every run has the same (Park and Miller). */
function* numbers(seed: number): Generator<number, never> {
  for (let state = seed; ; ) {
    state = (state * 48271) % 2147483647;
    yield state / 2147483647;
  }
}

describe("noise over frames", () => {
  test("is the deviation of the sample while the window fills", () => {
    const noise = new Noise();
    const values = [3.1, 2.9, 3.4, 3.0, 2.6, 3.3, 3.2];
    for (const value of values) noise.take(frame([value, 7]));
    const mean = values.reduce((sum, value) => sum + value) / values.length;
    const expected = Math.sqrt(values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / (values.length - 1));
    expect(noise.std(0)).toBeCloseTo(expected, 5);
    expect(noise.std(1)).toBe(0);
  });

  test("stays free of bias when older frames fade", () => {
    const pixels = 400;
    const [noise, random] = [new Noise(), numbers(7)];
    for (let n = 0; n < 4 * WINDOW; n++) noise.take(frame(Array.from({ length: pixels }, () => random.next().value)));
    const variances = Array.from({ length: pixels }, (_, at) => noise.std(at) ** 2);
    // of even numbers from 0 to 1
    expect(variances.reduce((sum, value) => sum + value) / pixels).toBeCloseTo(1 / 12, 2);
  });

  test("is not shown before there are enough frames with a value", () => {
    const noise = new Noise();
    for (let n = 1; n < FEWEST; n++) noise.take(frame([n, n]));
    expect(noise.std(0)).toBeNaN();
    noise.take(frame([5, NaN]));
    expect(noise.std(0)).toBeGreaterThan(0);
    expect(noise.std(1)).toBeNaN();
    expect(noise.std(99)).toBeNaN();
  });

  test.each([
    [2, "/frames/latest"],
    [1, "/recordings/r/frames/3"],
  ])("begins anew with sequence %i of %s", (sequence_id, origin) => {
    const noise = new Noise();
    for (let n = 0; n < 9; n++) noise.take(frame([n]));
    noise.take(frame([100], sequence_id, origin));
    expect(noise.frames.value).toBe(1);
    expect(noise.std(0)).toBeNaN();
  });

  test("begins anew with the first frame that is wholly of another scene", () => {
    const frames = new Frames();
    const noise = new Noises(frames).of("range");
    frames.claim(["range"]);
    const take = (value: number, host_time_s: number): void => {
      const shown = frame([value]);
      frames.put({ ...shown, product: "range", meta: { ...shown.meta, host_time_s, capture_s: 0.1 } } as Frame);
    };
    for (let n = 0; n < 9; n++) take(1, n);
    frames.sceneSince_s = 9;
    for (const host_time_s of [9, 9.05]) take(1, host_time_s);
    for (let n = 0; n < FEWEST; n++) take(7, 10 + n);
    expect(noise.std(0)).toBe(0);
  });
});
