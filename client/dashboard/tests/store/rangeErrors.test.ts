import { signal } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

import { LIVE, RequestError } from "../../src/store/api";
import { Frames } from "../../src/store/frames";
import { RangeErrors } from "../../src/store/rangeErrors";
import { Status } from "../../src/store/status";
import type { FrameMeta } from "../../src/stream/documents";
import type { FrameReport } from "../../src/stream/summary";

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

const meta = (sequence_id: number, range_error_m: number | null = null): FrameMeta =>
  ({
    sequence_id,
    frame: sequence_id,
    predicted_range_std_m: { median: 1e-3, p90: 2e-3 },
    accuracy: range_error_m === null ? null : { range_error_m },
  }) as FrameMeta;

function bench(answer: () => FrameMeta) {
  const [status, replaying, requests] = [new Status(), signal(false), [] as string[]];
  const errors = new RangeErrors(new Frames(), status, replaying);
  errors.loader = async (path, products) => {
    requests.push(`${path} ${products.join()}`);
    return [{ message: { meta: answer() } } as unknown as FrameReport];
  };
  status.connection.value = { kind: "open" };
  return { status, replaying, requests, errors };
}

describe("the error of the range", () => {
  test("is noise alone until the service was asked for the bias, once a sequence has stayed, and again", async () => {
    const { status, requests, errors } = bench(() => meta(4, 5e-3));
    expect(errors.now.value).toBeNull();
    status.newest.value = meta(3);
    await vi.advanceTimersByTimeAsync(1000);
    status.newest.value = meta(4); // another sequence
    await vi.advanceTimersByTimeAsync(1500);
    expect(requests).toEqual([]);
    expect(errors.now.value).toEqual({ error_m: 1e-3, of: "noise" });
    await vi.advanceTimersByTimeAsync(1000);
    expect(requests).toEqual([`${LIVE} range_error`]);
    expect(errors.now.value).toEqual({ error_m: 5e-3, of: "noise and bias" });
    await vi.advanceTimersByTimeAsync(30_000);
    expect(requests).toHaveLength(2);
    status.newest.value = meta(5);
    expect(errors.now.value).toEqual({ error_m: 1e-3, of: "noise" });
  });

  test("is that of the recording while one is shown, and nothing is requested", async () => {
    const { status, replaying, requests, errors } = bench(() => meta(1, 5e-3));
    replaying.value = true;
    status.newest.value = meta(1);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(requests).toEqual([]);
    expect(errors.now.value).toEqual({ error_m: 1e-3, of: "noise" });
    status.newest.value = meta(1, 7e-3);
    expect(errors.now.value).toEqual({ error_m: 7e-3, of: "noise and bias" });
  });

  test("is forgotten with its scene", async () => {
    const { status, errors } = bench(() => meta(1, 5e-3));
    status.newest.value = meta(1);
    await vi.advanceTimersByTimeAsync(2000);
    errors.sceneChanged();
    expect(errors.now.value?.of).toBe("noise");
    await vi.advanceTimersByTimeAsync(2000);
    expect(errors.now.value?.of).toBe("noise and bias");
  });

  test("stays noise for a camera that states none, which is not asked again", async () => {
    let asked = 0;
    const { status, errors } = bench(() => {
      asked += 1;
      throw new RequestError({ title: "no noise model" });
    });
    status.newest.value = meta(1);
    await vi.advanceTimersByTimeAsync(90_000);
    expect(asked).toBe(1);
    expect(errors.now.value?.of).toBe("noise");
  });
});
