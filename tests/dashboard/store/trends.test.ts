import { signal } from "@preact/signals";
import { describe, expect, test } from "vitest";
import { Frames } from "../../../client/dashboard/src/store/frames";
import { RangeErrors } from "../../../client/dashboard/src/store/rangeErrors";
import { Status } from "../../../client/dashboard/src/store/status";
import { KEPT_S, linesOf, type Sample, Trends } from "../../../client/dashboard/src/store/trends";
import type { FrameMeta } from "../../../client/dashboard/src/stream/documents";

const meta = (frame: number, host_time_s: number): FrameMeta =>
  ({ frame, host_time_s, sequence_id: 1, accuracy: { range_error_m: 0.004 } }) as FrameMeta;

function followed(): { status: Status; trends: Trends } {
  const status = new Status();
  return { status, trends: new Trends(status, new RangeErrors(new Frames(), status, signal(false), signal(false))) };
}

describe("trends", () => {
  test("follow rate, error and latency twice a second at most, for a minute", () => {
    const { status, trends } = followed();
    for (let frame = 1; frame <= 1000; frame++) status.frameDrawn(meta(frame, 0.1 * frame - 0.2), 0.1 * frame);
    const { samples } = trends;
    expect(samples.value.length).toBe(120);
    const times = samples.value.map(({ at_s }) => at_s);
    expect(Math.min(...times.slice(1).map((at_s, n) => at_s - times[n]))).toBeCloseTo(0.5, 6);
    expect(times[119] - times[0]).toBeLessThan(KEPT_S);
    const { rate_hz, error_m, latency_s } = samples.value[119];
    expect(rate_hz).toBeCloseTo(10, 6);
    expect(error_m).toBe(0.004);
    expect(latency_s).toBeCloseTo(0.2, 6);
  });

  test("count what was dropped between samples, anew in a new session, and take no clocks for a latency", () => {
    const { status, trends } = followed();
    status.frameDrawn(meta(1, 999), 1);
    status.dropNotice(1, 5);
    status.frameDrawn(meta(2, 999), 2);
    status.dropNotice(1, 12);
    status.frameDrawn(meta(3, 999), 3);
    status.sessionOpened("streaming", 3);
    status.dropNotice(1, 2);
    status.frameDrawn(meta(4, 999), 4);
    expect(trends.samples.value.map(({ dropped }) => dropped)).toEqual([0, 5, 7, 2]);
    expect(trends.samples.value.map(({ latency_s }) => latency_s)).toEqual([NaN, NaN, NaN, NaN]);
  });
});

describe("the line of a figure", () => {
  const sample = (at_s: number, rate_hz: number): Sample => ({ at_s, rate_hz, error_m: NaN, latency_s: NaN, dropped: 0 });

  test("ends at the right, is as high as its largest value, and breaks where nothing is known or came", () => {
    const samples = [sample(0, 5), sample(1, 10), sample(2, NaN), sample(3, 2), sample(30, 4)];
    expect(linesOf(samples, "rate_hz")).toEqual({
      most: 10,
      lines: [
        [
          { x: 0.5, y: 0.5 },
          { x: 1 - 29 / 60, y: 1 },
        ],
        [{ x: 1 - 27 / 60, y: 0.2 }],
        [{ x: 1, y: 0.4 }],
      ],
    });
    expect(linesOf(samples, "error_m")).toEqual({ most: 0, lines: [] });
    expect(linesOf([sample(7, 0)], "rate_hz")).toEqual({ most: 0, lines: [[{ x: 1, y: 0 }]] });
  });
});
