import { signal } from "@preact/signals";
import type { Bodies, JobDocument } from "../stream/documents";
import { type Api, refusalIn } from "./api";
import { followed } from "./jobs";
import type { Settings } from "./settings";

/** What one setting gave, by names with units. */
export type SeriesRow = Readonly<Record<string, number | string | null>>;

/** Settings that are compared by captured frames. */
export class Series {
  /** The one that is shown; null while there is none. */
  readonly job = signal<JobDocument | null>(null);
  /** Its id, which a link has. */
  readonly id;

  constructor(
    private readonly api: Api,
    settings: Settings,
  ) {
    this.id = settings.of<string>({ link: "series", followed: true, initial: "", text: String, parse: String });
  }

  get rows(): readonly SeriesRow[] {
    return (this.job.value?.result as { rows: SeriesRow[] } | null)?.rows ?? [];
  }

  async start(body: Bodies["POST /series/jobs"]): Promise<void> {
    await this.#follow(await this.api.ask("POST /series/jobs", { body }));
  }

  /** Shows the one that a link names; one that is not kept any more is as none. */
  async show(): Promise<void> {
    if (this.id.peek() === "" || this.job.peek()?.id === this.id.peek()) return;
    try {
      await this.#follow(await this.api.ask("GET /jobs/{job}", { of: this.id.peek() }));
    } catch (error) {
      refusalIn(error);
      this.id.value = "";
    }
  }

  async cancel(): Promise<void> {
    await this.api.ask("POST /jobs/{job}/cancel", { of: this.id.peek() });
  }

  async #follow(started: JobDocument): Promise<void> {
    this.id.value = started.id;
    await followed(this.api, started, (job) => (this.job.value = job));
  }
}
