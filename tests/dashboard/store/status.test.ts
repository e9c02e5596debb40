import { expect, test } from "vitest";

import { flowTrouble } from "../../../client/dashboard/src/store/status";

const well = { rate_hz: 10, latency_s: 0.1, last_s: 99.9 };

test("frames that come as the sequence has them are no trouble", () => {
  expect(flowTrouble(well, 10.6, 100)).toBeNull();
  expect(flowTrouble({ rate_hz: null, latency_s: null, last_s: null }, 10.6, 100)).toBeNull();
  // a sequence of half a minute is slow by itself
  expect(flowTrouble({ rate_hz: 1 / 30, latency_s: 0.1, last_s: 60 }, 1 / 30, 100)).toBeNull();
});

test("frames that come too seldom, too late or not at all are, and it says why", () => {
  expect(flowTrouble({ ...well, rate_hz: 0.3 }, 10.6, 100)).toContain("0.3 of 10.6 frames a second");
  expect(flowTrouble({ ...well, latency_s: 2 }, 10.6, 100)).toContain("2.0 s after they were captured");
  expect(flowTrouble({ ...well, last_s: 90 }, 10.6, 100)).toBe("No frame has come for 10 s.");
});

test("clocks that differ are not taken for late frames", () => expect(flowTrouble({ ...well, latency_s: 4000 }, 10.6, 100)).toBeNull());
