import { describe, expect, test } from "vitest";

import { multiplesWords } from "../../../client/dashboard/src/store/events";
import { EVERYTHING } from "../../../client/dashboard/src/stream/demand";
import type { FrameMeta } from "../../../client/dashboard/src/stream/documents";
import { measuredOf, sequenceProblem } from "../../../client/dashboard/src/views/sequence/words";
import { demandWords, exposureAdvice, lowerFrequency_hz } from "../../../client/dashboard/src/views/status/words";

const plain = (text: string): string => text.replaceAll("\u202f", " ");

test("a limit is said in the form's names and units", () => {
  const limit = "at most 1.875e+07 Hz: 8 harmonics have to stay below 1.5e+08 Hz";
  expect(plain(sequenceProblem({ field: "base_frequency_hz", limit }))).toBe(
    "Base frequency must be at most 18.75 MHz: 8 harmonics have to stay below 150 MHz.",
  );
  expect(plain(sequenceProblem({ field: "body.exposure_s", limit: "from 2e-05 to 0.05 s" }))).toBe("Exposure must be from 20 µs to 50 ms.");
});

test("a problem of another kind keeps its own words", () => {
  expect(sequenceProblem({ detail: "The camera is lost.", title: "Camera lost" })).toBe("The camera is lost.");
  expect(sequenceProblem({ field: "harmonics", title: "Invalid sequence" })).toBe("Invalid sequence");
});

test("what is asked for over a thin link, or by a slow browser, is said with its reason", () => {
  const slow = demandWords({ demand: { ...EVERYTHING, maxRate_hz: 8 }, carried_bytes_s: null, pictures_hz: 19.4 }, false);
  expect(plain(slow.short)).toBe("Slow browser: 8.0 Hz");
  expect(plain(slow.long)).toMatch(/^Before, this browser drew 19 pictures of the light a second.* asks for at most 8.0 Hz, and for more/);
  const both = demandWords({ demand: { maxRate_hz: 3, coded: true, part: true }, carried_bytes_s: 2e6, pictures_hz: 19.4 }, true);
  expect(plain(both.short)).toBe("Thin link: 3.0 Hz, 16 bits, the part in sight");
  expect(plain(both.long)).toMatch(/carried 2.00 MB\/s.* drew 19 pictures.* numbers in 16 bits, the part in sight only/);
});

describe("a frame with too much or too little light", () => {
  const CAMERA = { min_exposure_s: 2e-5, max_exposure_s: 0.05 };
  const frame = (saturated: number, no_signal: number, exposure_s = 0.016): FrameMeta =>
    ({ exposure_s, pixels: { total: 100, saturated, no_signal } }) as FrameMeta;

  test.each([
    [100, 0, "Saturated", 0.0005],
    [85, 0, "Saturated", 0.002],
    [20, 0, "Saturated", 0.008],
    [20, 70, "Saturated", 0.008],
    [0, 60, "Dark", 0.032],
    [0, 100, "Dark", 0.05],
  ])("of which %i %% are saturated and %i %% dark is called %s: %f s", (saturated, dark, word, exposure_s) => {
    const advice = exposureAdvice(frame(saturated, dark), CAMERA);
    expect(advice).toMatchObject({ word, exposure_s });
    expect(plain(advice?.long ?? "")).toContain(`${Math.max(saturated, saturated >= 10 ? 0 : dark)} % of the pixels`);
  });

  test("is dark by few pixels where even the brightest have little light", () => {
    const advice = (brightest_dn: number, no_signal = 18, exposure_s = 2e-5) =>
      exposureAdvice(frame(0, no_signal, exposure_s), { ...CAMERA, bits: 12 }, brightest_dn);
    expect(advice(40)).toMatchObject({ word: "Dark", exposure_s: 1.6e-4 });
    expect([advice(300), advice(40, 1), advice(40, 18, 0.05)]).toEqual([null, null, null]);
  });

  test("is saturated by few pixels, too, while an exposure is being mended", () => {
    expect(exposureAdvice(frame(2, 0), CAMERA)).toBeNull();
    expect(exposureAdvice(frame(2, 0), CAMERA, Infinity, true)).toMatchObject({ word: "Saturated" });
    expect(exposureAdvice(frame(0, 2), CAMERA, Infinity, true)).toBeNull();
  });

  test("is named where no exposure mends it, and one with enough light is not", () => {
    expect(exposureAdvice(frame(100, 0, 2e-5), CAMERA)).toMatchObject({ word: "Saturated", exposure_s: null });
    for (const meta of [frame(9, 0), frame(0, 49), { exposure_s: 1, pixels: null } as FrameMeta, null])
      expect(exposureAdvice(meta, CAMERA)).toBeNull();
  });
});

test("multiples of a camera's own are shown as these", () => {
  expect(measuredOf({ harmonics: 3, sampling: null })).toEqual({ name: "Harmonics m", value: "3" });
  expect(measuredOf({ harmonics: 3, sampling: { multiples: [2, 10, 15], phases_rad: [], max_range_m: null } })).toEqual({
    name: "Multiples",
    value: "2, 10, 15",
  });
  expect(multiplesWords(3, { multiples: [2, 10, 15], phases_rad: [], max_range_m: null })).toBe("multiples 2, 10, 15");
});

test("a lower base frequency is offered where ranges lie at an end of what is unambiguous, as far as the camera goes", () => {
  const applied = { base_frequency_hz: 23e6, unambiguous_range_m: 6.52 };
  const offered = (low: number, high: number, min_frequency_hz = 5e5): number | null =>
    lowerFrequency_hz({ low, high, kind: "linear" } as never, applied, { min_frequency_hz });
  expect([offered(1.6, 3), offered(0.1, 3), offered(1.6, 6.4)]).toEqual([null, 11.5e6, 11.5e6]);
  expect([offered(0.1, 3, 12e6), lowerFrequency_hz(null, applied, {})]).toEqual([null, null]);
});
