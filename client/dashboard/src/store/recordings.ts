import { computed, effect, untracked } from "@preact/signals";
import type { RecordingDocument, RecordingRequest, RecordingsDocument } from "../stream/documents";
import { type Api, refusalIn } from "./api";
import { Known } from "./known";

/** How often one that runs is looked at. */
const LOOK_MS = 1000;

/** Seconds of the past that one button saves. */
export const PAST_S = 10;

/** The recordings of the service, as the page last saw them. */
export class Recordings extends Known<RecordingsDocument> {
  /** The one that runs; null while none does. */
  readonly active = computed((): RecordingDocument | null => {
    const { active = null, recordings = [] } = this.document.value ?? {};
    return recordings.find(({ id }) => id === active) ?? null;
  });
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly api: Api) {
    super(() => api.ask("GET /recordings"));
    effect(() => {
      const running = this.active.value?.id;
      clearTimeout(this.#timer);
      if (running === undefined) return;
      void this.document.value; // each answer waits for the next
      this.#timer = setTimeout(() => void untracked(() => this.#look(running)), LOOK_MS);
    });
  }

  start(wanted: RecordingRequest): Promise<RecordingDocument> {
    return this.after(this.api.ask("POST /recordings", { body: wanted }));
  }

  /** Keeps what the service still holds of the last seconds. */
  async savePast(wanted: Pick<RecordingRequest, "name"> = {}): Promise<void> {
    const { id } = await this.start({ ...wanted, history_s: PAST_S });
    await this.stop(id);
  }

  async stop(id: string): Promise<void> {
    this.#put(await this.api.ask("POST /recordings/{recording}/stop", { of: id }));
    await this.refresh();
  }

  async annotate(id: string, annotations: Readonly<Record<string, unknown>>): Promise<void> {
    this.#put(await this.api.ask("PATCH /recordings/{recording}", { of: id, body: { annotations } }));
  }

  async remove(id: string): Promise<void> {
    await this.after(this.api.ask("DELETE /recordings/{recording}", { of: id }));
  }

  async #look(id: string): Promise<void> {
    try {
      const document = await this.api.ask("GET /recordings/{recording}", { of: id });
      if (document.state === "recording") this.#put(document);
      else await this.refresh();
    } catch (error) {
      refusalIn(error);
      await this.refresh();
    }
  }

  #put(changed: RecordingDocument): void {
    const known = this.document.peek();
    if (known === null) return;
    this.document.value = { ...known, recordings: known.recordings.map((each) => (each.id === changed.id ? changed : each)) };
  }
}
