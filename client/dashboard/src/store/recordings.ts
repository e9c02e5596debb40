import { effect, signal, untracked } from "@preact/signals";
import type { RecordingDocument, RecordingRequest, RecordingsDocument } from "../stream/documents";
import { type Api, RequestError, refusalIn } from "./api";
import { Known } from "./known";

/** How often one that runs is looked at. */
const LOOK_MS = 1000;

/** Seconds of the past that one button saves. */
export const PAST_S = 10;

/** Orders of the list, by what the service calls them. */
export const ORDERS = { "-started_s": "newest first", started_s: "oldest first", name: "by name", "-size_bytes": "largest first" } as const;

/** How many more are listed at a time. */
export const PAGE = 50;

/** A file on its way: the share of it that was sent, 0 to 1. */
type Sending = Readonly<{ name: string; share: number; cancel: () => void }>;

/** The recordings of the service that are looked for, as the page last saw them. */
export class Recordings extends Known<RecordingsDocument> {
  /** The one that runs, whether it is looked for or not; null while none does. */
  readonly active = signal<RecordingDocument | null>(null);
  readonly search = signal("");
  /** "" for any. */
  readonly tag = signal("");
  readonly order = signal<keyof typeof ORDERS>("-started_s");
  readonly limit = signal(PAGE);
  /** The file that is being sent; null while none is. */
  readonly sending = signal<Sending | null>(null);
  #asked = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly api: Api) {
    super(() => this.#read());
    effect(() => {
      void [this.search.value, this.tag.value, this.order.value, this.limit.value];
      void untracked(() => this.keepUp());
    });
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

  /** Sends the file of a recording, which the service keeps. */
  async send(file: Blob & Readonly<{ name: string }>): Promise<RecordingDocument> {
    if (this.sending.peek() !== null) throw new RequestError({ detail: `${file.name} was not sent: another file is on its way.` });
    const cancelling = new AbortController();
    const cancel = (): void => cancelling.abort();
    const onSent = (share: number): void => void (this.sending.value = { name: file.name, share, cancel });
    onSent(0);
    try {
      return await this.after(this.api.ask("POST /recordings/import", { body: file, signal: cancelling.signal, onSent }));
    } catch (error) {
      if (cancelling.signal.aborted) throw new RequestError({ detail: `${file.name} was not sent: you cancelled it.` });
      throw error;
    } finally {
      this.sending.value = null;
    }
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

  async #read(): Promise<RecordingsDocument> {
    const asked = ++this.#asked;
    const query = new URLSearchParams({ search: this.search.peek(), sort: this.order.peek(), limit: `${this.limit.peek()}` });
    if (this.tag.peek() !== "") query.set("tag", this.tag.peek());
    const found = await this.api.ask("GET /recordings", { at: `/recordings?${query}` });
    const of = found.active;
    const listed = found.recordings.find(({ id }) => id === of) ?? null;
    const active = of === null || listed !== null ? listed : await this.api.ask("GET /recordings/{recording}", { of });
    // what was asked before the last one may be answered after it
    if (asked !== this.#asked) return this.document.peek() ?? found;
    this.active.value = active;
    return found;
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
    if (this.active.peek()?.id === changed.id) this.active.value = changed.state === "recording" ? changed : null;
    const known = this.document.peek();
    if (known === null) return;
    this.document.value = { ...known, recordings: known.recordings.map((each) => (each.id === changed.id ? changed : each)) };
  }
}
