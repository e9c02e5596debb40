import { afterEach, beforeEach, expect, test, vi } from "vitest";

import { Accuracy } from "../../../client/dashboard/src/store/accuracy";
import { RequestError } from "../../../client/dashboard/src/store/api";
import type { JobDocument } from "../../../client/dashboard/src/stream/documents";
import { answering } from "../answering";

const job = (state: JobDocument["state"], more: Partial<JobDocument> = {}): JobDocument => ({
  id: "j",
  kind: "tradeoff",
  state,
  progress: 0.5,
  step: "…",
  result: null,
  problem: null,
  created_at: 0,
  finished_at: null,
  ...more,
});
const front = (...times_s: number[]): JobDocument["result"] => ({ front: times_s.map((capture_s) => ({ capture_s })), summary: "So far." });

let answers: (JobDocument | RequestError)[];
let cancelled: string[];
let files: string[];
let refusal: RequestError | null;
let accuracy: Accuracy;
beforeEach(() => {
  vi.useFakeTimers();
  [answers, cancelled, files, refusal] = [[], [], [], null];
  const start = () => (refusal === null ? Promise.resolve(job("queued")) : Promise.reject(refusal));
  const api = answering(
    {
      "POST /tradeoff/jobs": start,
      "POST /plan/jobs": start,
      "GET /jobs/{job}": () => {
        const answer = answers.shift() ?? job("running");
        return answer instanceof RequestError ? Promise.reject(answer) : Promise.resolve(answer);
      },
      "POST /jobs/{job}/cancel": ({ of }) => {
        cancelled.push(of);
        return Promise.resolve(job("running"));
      },
    },
    {
      file: (path: string) => {
        files.push(path);
        return Promise.resolve(new File(["picture"], "map.png"));
      },
    },
  );
  accuracy = new Accuracy(api);
});
afterEach(() => vi.useRealTimers());

const times = (): number[] | undefined => accuracy.tradeoff.value?.front.map(({ capture_s }) => capture_s);

test("the front fills while it is predicted", async () => {
  void accuracy.predict();
  await vi.advanceTimersByTimeAsync(1);
  expect(accuracy.job.value?.state).toBe("queued");
  for (const points of [[], [1, 9], [1, 3, 9]]) {
    answers.push(job("running", { result: front(...points) }));
    await vi.advanceTimersByTimeAsync(500);
    expect(times()).toEqual(points.length === 0 ? undefined : points);
  }
  answers.push(job("done", { result: front(1, 2, 3, 9) }));
  await vi.advanceTimersByTimeAsync(500);
  expect(times()).toEqual([1, 2, 3, 9]);
  expect([accuracy.job.value, accuracy.problem.value]).toEqual([null, null]);
});

test("a front that is cancelled keeps its points, and one without any the former ones", async () => {
  void accuracy.predict();
  await vi.advanceTimersByTimeAsync(1);
  await accuracy.cancel();
  answers.push(job("cancelled", { result: front(1, 9) }));
  await vi.advanceTimersByTimeAsync(500);
  expect(cancelled).toEqual(["j"]);
  expect(times()).toEqual([1, 9]);
  void accuracy.predict();
  answers.push(job("cancelled"));
  await vi.advanceTimersByTimeAsync(500);
  expect(times()).toEqual([1, 9]);
  expect(accuracy.job.value).toBeNull();
});

test("one question is asked at a time", async () => {
  void accuracy.predict();
  await vi.advanceTimersByTimeAsync(1);
  await accuracy.plan({ target: { range_error_m: 0.01 }, budget: {} });
  answers.push(job("done", { result: front(1, 9) }));
  await vi.advanceTimersByTimeAsync(500);
  expect([accuracy.looked.value, times()]).toEqual([null, [1, 9]]);
});

test("a plan is what is looked at then; why there is none is kept", async () => {
  void accuracy.plan({ target: { range_error_m: 0.01 }, budget: {} });
  answers.push(job("done", { kind: "plan", result: { capture_s: 5 } }));
  await vi.advanceTimersByTimeAsync(500);
  expect(accuracy.looked.value).toEqual({ capture_s: 5 });
  expect(files).toEqual(["/jobs/j/map.png"]);
  expect(accuracy.mapped.value).toEqual({ plan: accuracy.looked.value, url: expect.stringMatching(/^blob:/) });
  void accuracy.plan({ target: { range_error_m: 1e-9 }, budget: {} });
  answers.push(job("failed", { kind: "plan", problem: { title: "Out of reach" } }));
  await vi.advanceTimersByTimeAsync(500);
  expect([accuracy.looked.value, accuracy.mapped.value, files.length]).toEqual([null, null, 1]);
  expect(accuracy.problem.value).toEqual({ title: "Out of reach" });
  refusal = new RequestError({ title: "Eight plans wait." });
  await accuracy.predict();
  expect(accuracy.problem.value).toEqual({ title: "Eight plans wait." });
});

test("a front is outdated from the next scene on, also one whose prediction began before", async () => {
  void accuracy.predict();
  await vi.advanceTimersByTimeAsync(1);
  accuracy.sceneChanged();
  expect(accuracy.outdated.value).toBe(false);
  answers.push(job("done", { result: front(1, 9) }));
  await vi.advanceTimersByTimeAsync(500);
  expect(accuracy.outdated.value).toBe(true);
  void accuracy.predict();
  answers.push(job("done", { result: front(1, 8) }));
  await vi.advanceTimersByTimeAsync(500);
  expect(accuracy.outdated.value).toBe(false);
});

test("a service that was started anew knows no answer, and it is said", async () => {
  void accuracy.predict();
  answers.push(new RequestError({ title: "Unknown job", status: 404 }));
  await vi.advanceTimersByTimeAsync(500);
  expect(accuracy.job.value).toBeNull();
  expect(accuracy.problem.value?.title).toContain("started anew");
});

test("it is predicted with the estimator that was chosen, or the best of the service's own", async () => {
  const asked: unknown[] = [];
  const api = answering({
    "POST /tradeoff/jobs": ({ body }) => {
      asked.push(body?.estimator);
      return Promise.resolve(job("done"));
    },
    "GET /jobs/{job}": () => Promise.resolve(job("done")),
  });
  const chosen = new Accuracy(api);
  await Promise.all([chosen.predict(), vi.advanceTimersByTimeAsync(2000)]);
  chosen.estimator.value = "matched-filter";
  await Promise.all([chosen.predict(), vi.advanceTimersByTimeAsync(2000)]);
  expect(asked).toEqual([null, "matched-filter"]);
});
