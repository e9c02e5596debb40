import { signal } from "@preact/signals";
import type { CalibrationRequest, CalibrationsDocument, JobDocument, VerdictDocument } from "../stream/documents";
import { type Api, plainWords, refusalIn } from "./api";
import { followed, hasEnded } from "./jobs";
import { Known } from "./known";

/** How often drift is looked at while the list is in sight. */
const DRIFT_S = 15;

/** The calibrations of the service, and the measurement of one. */
export class Calibrations extends Known<CalibrationsDocument> {
  /** The measurement that runs; null while none does. */
  readonly job = signal<JobDocument | null>(null);
  /** How the last measurement that this page followed ended, in words. */
  readonly outcome = signal<{ readonly words: string; readonly good: boolean } | null>(null);

  constructor(private readonly api: Api) {
    super(() => api.ask("GET /calibrations"));
  }

  /** Keeps the list as it is at the service while it is looked at; the answer ends it. */
  follow(): () => void {
    void this.refresh();
    void this.#findJob();
    const timer = setInterval(() => void this.refresh(), 1000 * DRIFT_S);
    return () => clearInterval(timer);
  }

  async measure(wanted: CalibrationRequest): Promise<void> {
    this.outcome.value = null;
    void this.#follow(await this.api.ask("POST /calibrations", { body: wanted }));
  }

  async cancel(): Promise<void> {
    const job = this.job.peek();
    if (job !== null) await this.api.ask("POST /jobs/{job}/cancel", { of: job.id });
  }

  async activate(id: string, force = false): Promise<void> {
    await this.after(this.api.ask("PUT /calibrations/active", { body: { id, force } }));
  }

  /** Returns to the calibration that was active before. */
  async restore(): Promise<void> {
    await this.after(this.api.ask("POST /calibrations/active/undo"));
    this.outcome.value = null;
  }

  async take(file: Blob): Promise<void> {
    await this.after(this.api.ask("POST /calibrations/import", { body: file }));
  }

  async remove(id: string): Promise<void> {
    await this.after(this.api.ask("DELETE /calibrations/{calibration}", { of: id }));
  }

  /** Another client may have begun to measure. */
  async #findJob(): Promise<void> {
    if (this.job.peek() !== null) return;
    try {
      const { jobs } = await this.api.ask("GET /jobs");
      const running = jobs.find((each) => each.kind === "calibration" && !hasEnded(each));
      if (running !== undefined) void this.#follow(running);
    } catch (error) {
      refusalIn(error); // the list says what is wrong
    }
  }

  async #follow(started: JobDocument): Promise<void> {
    const ended = await followed(this.api, started, (job) => (this.job.value = job));
    this.job.value = null;
    if (ended === null) return;
    this.outcome.value = outcomeOf(ended);
    void this.refresh();
  }
}

function outcomeOf({ state, problem, result }: JobDocument): { words: string; good: boolean } {
  if (state === "cancelled") return { words: "The measurement was cancelled.", good: false };
  if (state === "failed") return { words: problem === null ? "The measurement failed." : plainWords(problem), good: false };
  const [bad, rejected] = [Number(result?.bad_pixels ?? 0), Number(result?.rejected_images ?? 0)];
  const words = `${bad} bad ${bad === 1 ? "pixel" : "pixels"}, ${rejected} ${rejected === 1 ? "image" : "images"} left out as unlike the others.`;
  const verdict = result?.verdict as VerdictDocument | undefined;
  if (verdict === undefined || verdict.verdict === "diffusor") return { words: `Measured: ${words}`, good: true };
  const use = result?.activated === true ? "It is used, as it was forced." : "It is kept, but not used.";
  return {
    words: `Measured on ${verdict.verdict === "scene" ? "a scene, not a diffuser" : "what may be no diffuser"}: ${use}`,
    good: false,
  };
}
