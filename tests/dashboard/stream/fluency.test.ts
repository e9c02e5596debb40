import { describe, expect, test } from "vitest";

import { Fluency } from "../../../client/dashboard/src/stream/fluency";

/** Refreshes at a rate for a time. */
function refresh(fluency: Fluency, from_s: number, span_s: number, rate_hz: number): number[] {
  const reports: number[] = [];
  for (let n = 0; n <= span_s * rate_hz; n++) {
    const report = fluency.refreshed(from_s + n / rate_hz);
    if (report !== null) reports.push(report);
  }
  return reports;
}

describe("fluency", () => {
  test("is pictures a second, every 2 s", () => {
    const reports = refresh(new Fluency(), 100, 8.1, 50);
    expect(reports).toHaveLength(4);
    for (const pictures_hz of reports) expect(pictures_hz).toBeCloseTo(50, 6);
  });

  test("does not count the time in which nothing moves or nobody looks", () => {
    const fluency = new Fluency();
    expect(refresh(fluency, 0, 1.5, 50)).toEqual([]);
    fluency.restart();
    expect(refresh(fluency, 4, 1.5, 50)).toEqual([]);
    expect(refresh(fluency, 40, 1.5, 50)).toEqual([]); // the machine slept, and the page was not told
    expect(refresh(fluency, 41.52, 1, 50)[0]).toBeCloseTo(50, 6);
  });
});
