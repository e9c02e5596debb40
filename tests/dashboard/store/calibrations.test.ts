import { afterEach, beforeEach, expect, test, vi } from "vitest";

import { RequestError } from "../../../client/dashboard/src/store/api";
import { Calibrations } from "../../../client/dashboard/src/store/calibrations";
import type { JobDocument } from "../../../client/dashboard/src/stream/documents";
import { answering } from "../answering";

const job = (state: JobDocument["state"], more: Partial<JobDocument> = {}): JobDocument => ({
  id: "j",
  kind: "calibration",
  state,
  progress: 0.5,
  step: "capturing",
  result: null,
  problem: null,
  created_at: 0,
  finished_at: null,
  ...more,
});

let answers: (JobDocument | RequestError)[];
let lists: number;
let calibrations: Calibrations;
beforeEach(() => {
  vi.useFakeTimers();
  answers = [];
  lists = 0;
  const api = answering({
    "GET /calibrations": () => {
      lists += 1;
      return Promise.resolve({ active: "nominal", directory: "", calibrations: [] });
    },
    "POST /calibrations": () => Promise.resolve(job("queued")),
    "POST /jobs/{job}/cancel": () => Promise.resolve(job("running")),
    "GET /jobs": () => ({ jobs: [job("done"), job("running", { id: "theirs" })] }),
    "GET /jobs/{job}": () => {
      const answer = answers.shift() ?? job("running");
      return answer instanceof RequestError ? Promise.reject(answer) : Promise.resolve(answer);
    },
  });
  calibrations = new Calibrations(api);
});
afterEach(() => vi.useRealTimers());

test("a measurement is followed to its end, and the list read anew then", async () => {
  await calibrations.measure({ name: "", frames: 40, activate: true });
  expect(calibrations.job.value?.state).toBe("queued");
  answers.push(job("running", { progress: 0.7 }));
  await vi.advanceTimersByTimeAsync(500);
  expect(calibrations.job.value?.progress).toBe(0.7);
  answers.push(job("done", { result: { bad_pixels: 3, rejected_images: 1 } }));
  await vi.advanceTimersByTimeAsync(500);
  expect(calibrations.job.value).toBeNull();
  expect(calibrations.outcome.value).toEqual({ good: true, words: "Measured: 3 bad pixels, 1 image left out as unlike the others." });
  expect(lists).toBe(1);
});

test.each([
  ["scene", false, "Measured on a scene, not a diffuser: It is kept, but not used."],
  ["in-doubt", false, "Measured on what may be no diffuser: It is kept, but not used."],
  ["scene", true, "Measured on a scene, not a diffuser: It is used, as it was forced."],
])("a measurement on what is no diffuser is no success (%s, activated: %s)", async (verdict, activated, words) => {
  await calibrations.measure({ name: "", frames: 40, activate: true });
  answers.push(
    job("done", {
      result: { bad_pixels: 0, rejected_images: 0, activated, verdict: { verdict, reason: "…", block_px: 8, blocks: ["#"] } },
    }),
  );
  await vi.advanceTimersByTimeAsync(500);
  expect(calibrations.outcome.value).toEqual({ good: false, words });
});

test("a measurement that failed says why", async () => {
  await calibrations.measure({ name: "", frames: 40, activate: true });
  answers.push(job("failed", { problem: { title: "Camera not connected" } }));
  await vi.advanceTimersByTimeAsync(500);
  expect(calibrations.outcome.value).toEqual({ good: false, words: "Camera not connected" });
});

test("a service that cannot be reached for a while loses no measurement; one started anew does", async () => {
  await calibrations.measure({ name: "", frames: 40, activate: true });
  answers.push(new RequestError({ title: "The service cannot be reached." }));
  await vi.advanceTimersByTimeAsync(500);
  expect(calibrations.job.value).not.toBeNull();
  answers.push(new RequestError({ title: "Unknown job", status: 404 }));
  await vi.advanceTimersByTimeAsync(500);
  expect(calibrations.job.value).toBeNull();
});

test("a measurement that another client began is shown", async () => {
  const end = calibrations.follow();
  await vi.advanceTimersByTimeAsync(1);
  expect(calibrations.job.value?.id).toBe("theirs");
  end();
});
