import { expect, test } from "vitest";

import { ageOf, doubtOf, driftOf } from "../../../client/dashboard/src/views/calibration/words";

test("an age is said as people do", () =>
  expect([5, 600, 7200, 864_000].map(ageOf)).toEqual(["just now", "10 min ago", "2 h ago", "10 days ago"]));

test("drift is shown beside what it was, and called for only where it has grown", () => {
  const grown = driftOf({ invalid_share: 0.081, invalid_share_at_capture: 0.004, frame: 9 });
  expect(grown).toEqual({
    grown: true,
    words: "8.1\u202f% of the pixels contradict themselves; 0.4\u202f% when it was measured. It should be measured anew.",
  });
  expect(driftOf({ invalid_share: 0.005, invalid_share_at_capture: 0.001, frame: 9 }).grown).toBe(false);
  expect(driftOf({ invalid_share: 0.4, invalid_share_at_capture: null, frame: 9 })).toEqual({
    grown: false,
    words: "40.0\u202f% of the pixels contradict themselves.",
  });
});

test("only what was not measured on a diffuser is doubted", () => {
  const verdict = { reason: null, block_px: 8, blocks: ["."], tests: [], reference: "nominal" };
  expect(doubtOf({ ...verdict, verdict: "diffusor" })).toBeNull();
  expect(doubtOf({ ...verdict, verdict: "in-doubt" })?.tag).toBe("in doubt");
  expect(doubtOf({ ...verdict, verdict: "scene" })?.tag).toBe("of a scene");
});
