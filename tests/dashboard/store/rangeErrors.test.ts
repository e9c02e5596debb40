import { signal } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

import { RequestError } from "../../../client/dashboard/src/store/api";
import { Frames } from "../../../client/dashboard/src/store/frames";
import { RangeErrors } from "../../../client/dashboard/src/store/rangeErrors";
import { Status } from "../../../client/dashboard/src/store/status";
import type { FrameMeta } from "../../../client/dashboard/src/stream/documents";
import type { FrameReport } from "../../../client/dashboard/src/stream/summary";
import { shareWords } from "../../../client/dashboard/src/views/sequence/words";

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

const meta = (sequence_id: number, range_error_m: number | null = null, frame = sequence_id): FrameMeta =>
  ({
    sequence_id,
    frame,
    predicted_range_std_m: { median: 1e-3, p90: 2e-3 },
    accuracy: range_error_m === null ? null : { range_error_m, range_std_m: 3e-4, range_bias_m: 4e-4, trusted_share: 0.82, within_m: 4e-3 },
  }) as FrameMeta;

/** Maps of 2 x 1 pixels: 5 mm and nothing, trusted and in shadow. */
const VALUES: Readonly<Record<string, readonly number[]>> = { range_error: [5e-3, NaN], trust: [0, 5] };

function bench(answer: () => FrameMeta) {
  const [status, replaying, held, requests] = [new Status(), signal(false), signal(false), [] as string[]];
  const errors = new RangeErrors(new Frames(), status, replaying, held);
  errors.loader = async (path, products) => {
    requests.push(path);
    return products.map((product) => ({
      message: { product, unit: "m", meta: answer(), array: { shape: [1, 2], data: Float32Array.from(VALUES[product] ?? [NaN, NaN]) } },
      map: null,
      light: null,
    })) as unknown as FrameReport[];
  };
  status.connection.value = { kind: "open" };
  return { status, replaying, held, requests, errors };
}

const noise = { error_m: 1e-3, of: "noise", planned_m: 1e-3, trusted_share: null, within_m: null, not_judged: [] };
const interval = (error_m: number) => ({ error_m, of: "interval", planned_m: 5e-4, trusted_share: 0.82, within_m: 4e-3, not_judged: [] });

describe("the error of the range", () => {
  test("is noise alone until the service was asked, once a sequence has stayed, and again", async () => {
    const { status, requests, errors } = bench(() => meta(4, 5e-3));
    expect(errors.now.value).toBeNull();
    status.newest.value = meta(3);
    await vi.advanceTimersByTimeAsync(1000);
    status.newest.value = meta(4); // another sequence
    await vi.advanceTimersByTimeAsync(1500);
    expect(requests).toEqual([]);
    expect(errors.now.value).toEqual(noise);
    await vi.advanceTimersByTimeAsync(1000);
    expect(requests).toEqual(["/frames/latest", "/frames/4"]);
    expect(errors.now.value).toEqual(interval(5e-3));
    await vi.advanceTimersByTimeAsync(3000);
    expect(requests).toHaveLength(4);
    status.newest.value = meta(5);
    expect(errors.now.value).toEqual(noise);
  });

  test("is that of the frame that is held, also where those of one before it come later", async () => {
    const { status, held, errors } = bench(() => meta(4, 5e-3, 8));
    const loader = errors.loader;
    let arrive = (): void => undefined;
    errors.loader = async (path, products) => {
      await new Promise<void>((resolve) => (arrive = resolve));
      return (await bench(() => meta(4, 9e-3, 7)).errors.loader?.(path, products)) ?? [];
    };
    status.newest.value = meta(4, null, 7);
    await vi.advanceTimersByTimeAsync(2500);
    const late = arrive;
    errors.loader = loader;
    status.newest.value = meta(4, null, 8);
    held.value = true;
    await vi.advanceTimersByTimeAsync(200);
    expect(errors.now.value).toEqual(interval(5e-3));
    late();
    await vi.advanceTimersByTimeAsync(200);
    expect(errors.now.value).toEqual(interval(5e-3));
  });

  test("is known of each pixel, with why not to trust it, until the sequence or the scene is another", async () => {
    const { status, errors } = bench(() => meta(4, 5e-3));
    status.newest.value = meta(4);
    await vi.advanceTimersByTimeAsync(2000);
    const at = (x: number): number[] => [errors.at("range_error", { x, y: 0 }), errors.at("trust", { x, y: 0 })];
    expect(at(0)).toEqual([Math.fround(5e-3), 0]);
    expect(at(1)).toEqual([NaN, 5]);
    expect(at(2)).toEqual([NaN, NaN]);
    status.newest.value = meta(5);
    expect(at(0)).toEqual([NaN, NaN]);
    status.newest.value = meta(4);
    expect(at(0)[1]).toBe(0);
    errors.sceneChanged();
    expect(at(0)).toEqual([NaN, NaN]);
    expect(errors.now.value?.of).toBe("noise");
    await vi.advanceTimersByTimeAsync(2000);
    expect(errors.now.value?.of).toBe("interval");
  });

  test("is that of the very frame that is held or replayed", async () => {
    const { status, replaying, held, requests, errors } = bench(() => meta(4, 5e-3, 8));
    status.newest.value = meta(4, null, 7);
    held.value = true;
    await vi.advanceTimersByTimeAsync(60_000);
    expect(requests).toEqual(["/frames/7", "/frames/7"]);
    expect(errors.now.value).toEqual(noise); // the service answered with another frame
    status.newest.value = meta(4, null, 8);
    expect(errors.now.value).toEqual(interval(5e-3));
    [held.value, replaying.value] = [false, true];
    status.newest.value = meta(4, 7e-3, 9);
    expect(errors.now.value).toEqual(interval(7e-3));
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

  test("is asked for again where the frame was gone already", async () => {
    let asked = 0;
    const { status } = bench(() => {
      asked += 1;
      throw new RequestError({ type: "/problems/frame-gone" });
    });
    status.newest.value = meta(1);
    await vi.advanceTimersByTimeAsync(6000);
    expect(asked).toBe(2);
  });
});

test("a picture's ranges are stated as shares of it", () => {
  const words = (figure: Parameters<typeof shareWords>[0]): string[] =>
    Object.values(shareWords(figure)).map((each) => each.replaceAll("\u202f", " "));
  expect(words({ ...interval(5e-3), of: "interval" })).toEqual([
    "82 % ± 4.0 mm",
    "82 % of the picture ± 4.0 mm (90 % intervals), 18 % not trusted",
  ]);
  // pixels that nothing known would distrust count as trusted: the share is at most that
  const [short, long] = words({ ...interval(5e-3), of: "interval", not_judged: ["no_direct_light"] });
  expect(short).toBe("≤ 82 % ± 4.0 mm");
  expect(long).toMatch(/^≤ 82 % .*; not judged: no direct light \(needs the beam of the light, .*calibrate URL --beam/);
  expect(words({ error_m: 1e-3, of: "noise", planned_m: 1e-3, trusted_share: 0.5, within_m: null })[0]).toBe("50 % trusted");
  expect(words({ ...noise, of: "noise" })[0]).toBe("± 1.0 mm noise");
});
