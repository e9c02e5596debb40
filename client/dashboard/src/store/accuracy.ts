import { computed, signal } from "@preact/signals";

import type { ChoiceDocument, JobDocument, PlanDocument, PlanRequest, TradeoffDocument } from "../stream/documents";
import type { Problem } from "../stream/protocol";
import { type Api, refusalIn } from "./api";
import { followed } from "./jobs";

/** What accuracy costs in time on the scene before the camera, and the choice that is looked at; null while there is none. */
export class Accuracy {
  /** With the points that there are so far, while it is predicted. */
  readonly tradeoff = signal<TradeoffDocument | null>(null);
  /** A point of the front or a plan that is looked at, and not set. */
  readonly looked = signal<ChoiceDocument | null>(null);
  /** A plan that was made, and a picture of the error that it predicts of each pixel: an address; null while there is none. */
  readonly mapped = signal<{ readonly plan: PlanDocument; readonly url: string } | null>(null);
  /** Estimators of other packages, by name and label, and the one to plan with: "" for the best of the service's own. */
  readonly others = signal<readonly Readonly<{ name: string; label: string }>[]>([]);
  readonly estimator = signal("");
  /** What the service computes for this page. */
  readonly job = signal<JobDocument | null>(null);
  /** Why the last question had no answer. */
  readonly problem = signal<Problem | null>(null);
  /** Whether the front is of a scene that the camera stands before no more. */
  readonly outdated = computed(() => this.tradeoff.value !== null && this.#predicted.value !== this.#scene.value);
  /** Counts the scenes, and which of them the front is of. */
  readonly #scene = signal(0);
  readonly #predicted = signal(0);

  constructor(private readonly api: Api) {}

  /** Predicts the front; a page asks one question at a time. */
  async predict(): Promise<void> {
    const scene = this.#scene.peek();
    await this.#ask(
      () => this.api.ask("POST /tradeoff/jobs", { body: { by: "range_error_m", estimator: this.estimator.peek() || null } }),
      ({ result }) => {
        const soFar = result as TradeoffDocument | null;
        if (soFar === null || soFar.front.length === 0) return;
        this.#predicted.value = scene;
        this.tradeoff.value = soFar;
      },
    );
  }

  /** Looks for a sequence for a goal. */
  async plan(goal: PlanRequest): Promise<void> {
    this.looked.value = null; // it would seem to answer this question
    const before = this.mapped.peek();
    if (before !== null) URL.revokeObjectURL(before.url);
    this.mapped.value = null;
    let made: string | null = null;
    await this.#ask(
      () => this.api.ask("POST /plan/jobs", { body: { ...goal, map: true, estimator: this.estimator.peek() || null } }),
      ({ id, result, state }) => {
        if (result !== null) this.looked.value = result as unknown as PlanDocument;
        if (state === "done") made = id;
      },
    );
    const plan = this.looked.peek() as PlanDocument | null;
    if (made === null || plan === null) return;
    const path = `/jobs/${encodeURIComponent(made)}/map.png`;
    const file = await this.#answer(() => this.api.file(path));
    if (file !== null) this.mapped.value = { plan, url: URL.createObjectURL(file) };
  }

  async cancel(): Promise<void> {
    const job = this.job.peek();
    if (job !== null) await this.#answer(() => this.api.ask("POST /jobs/{job}/cancel", { of: job.id }));
  }

  /** The camera stands before another scene: what was predicted is of the one before. */
  sceneChanged(): void {
    this.#scene.value += 1;
  }

  async #ask(start: () => Promise<JobDocument>, seen: (job: JobDocument) => void): Promise<void> {
    if (this.job.peek() !== null) return;
    this.problem.value = null;
    const started = await this.#answer(start);
    if (started === null) return;
    const ended = await followed(this.api, started, (job) => {
      this.job.value = job;
      seen(job);
    });
    this.job.value = null;
    this.problem.value = ended === null ? { title: "The service was started anew and knows nothing of this any more." } : ended.problem;
  }

  /** What the service answers; null where it refuses, which is kept. */
  async #answer<T>(question: () => Promise<T>): Promise<T | null> {
    try {
      return await question();
    } catch (error) {
      this.problem.value = refusalIn(error).problem;
      return null;
    }
  }
}
