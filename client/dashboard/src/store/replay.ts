/** A recording on the page: its frames take the place of the camera's, for all views alike. */
import { batch, computed, effect, signal, untracked } from "@preact/signals";
import type { RecordingDocument, TimelineDocument } from "../stream/documents";
import { LEAST_PRODUCTS } from "../stream/protocol";
import type { FrameReport } from "../stream/summary";
import { type Api, RequestError, recordingPath, refusalIn } from "./api";
import { type Frames, frameOf } from "./frames";
import type { Status } from "./status";

/** Brings products of the frame at a path of the service; raises RequestError. */
export type FrameLoader = (path: string, products: readonly string[]) => Promise<readonly FrameReport[]>;

/** A recording's frames by number, and when each was captured after the first; of one that has frames. */
export type Timeline = TimelineDocument & { readonly first: number; readonly last: number };

/** Which settings a recorded frame is computed with: those it was recorded with, or those the service has now. */
export type ReplaySettings = "recorded" | "current";

/** Recorded seconds that pass in a second of watching. */
export const REPLAY_SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

/** How often a recording that is still being written is looked at again. */
const GROWS_MS = 2000;

export class Replay {
  /** The recording that is shown; null while the camera is. */
  readonly recording = signal<RecordingDocument | null>(null);
  readonly timeline = signal<Timeline | null>(null);
  /** The frame that is wanted, by its number in the recording. */
  readonly frame = signal(0);
  /** The frame that is on screen; null before the first. */
  readonly shown = signal<number | null>(null);
  readonly playing = signal(false);
  readonly speed = signal<number>(1);
  readonly settings = signal<ReplaySettings>("recorded");
  readonly trouble = signal<string | null>(null);
  readonly active = computed(() => this.recording.value !== null);
  /** Set by what talks to the worker. */
  loader: FrameLoader | null = null;
  /** Where playing has come to, in s since the recording began. */
  #at_s = 0;
  #loading = false;
  /** What is on screen, in words; "" for nothing. */
  #loaded = "";
  #recomputed = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly api: Api,
    private readonly frames: Frames,
    private readonly status: Status,
  ) {
    effect(() => {
      if (this.recording.value === null || this.timeline.value === null) return;
      void [this.frame.value, this.settings.value, this.frames.wanted.value];
      untracked(() => void this.#load());
    });
  }

  /** Shows a recording from a frame on, by default its first. Raises RequestError. */
  async open(id: string, frame?: number): Promise<void> {
    const [recording, timeline] = await this.#read(id);
    if (!hasFrames(timeline)) throw new RequestError({ detail: `${recording.name} holds no frames.` });
    batch(() => {
      this.trouble.value = null;
      this.playing.value = false;
      this.shown.value = null;
      this.#loaded = "";
      this.recording.value = recording;
      this.timeline.value = timeline;
      this.seek(frame ?? timeline.first);
    });
    this.#watchGrowth();
  }

  /** Back to what the camera sees. */
  leave(): void {
    if (!this.active.peek()) return;
    clearTimeout(this.#timer);
    batch(() => {
      this.playing.value = false;
      this.recording.value = null;
      this.timeline.value = null;
      this.shown.value = null;
      this.trouble.value = null;
      this.status.newest.value = null; // a frame of the camera may have the same number
    });
  }

  /** Time of a frame since the recording began, in s. */
  timeOf(frame: number): number {
    const timeline = this.timeline.peek();
    if (timeline === null) return 0;
    const place = (frame - timeline.first) / timeline.times_step;
    const [before, after] = [timeline.times_s[Math.floor(place)], timeline.times_s[Math.floor(place) + 1]];
    return after === undefined ? (before ?? timeline.times_s.at(-1) ?? 0) : before + (place % 1) * (after - before);
  }

  /** The settings of the reconstruction changed: frames that are computed with the present ones look otherwise. */
  recompute(): void {
    if (this.settings.peek() !== "current") return;
    this.#recomputed += 1;
    void this.#load();
  }

  seek(frame: number): void {
    const timeline = this.timeline.peek();
    if (timeline === null) return;
    this.frame.value = Math.min(timeline.last, Math.max(timeline.first, Math.round(frame)));
    this.#at_s = this.timeOf(this.frame.peek());
  }

  step(by: number): void {
    this.playing.value = false;
    this.seek(this.frame.peek() + by);
  }

  /** Plays from here, from the start if this is the end; or pauses. */
  toggle(): void {
    const timeline = this.timeline.peek();
    if (timeline === null) return;
    if (!this.playing.peek() && this.frame.peek() >= timeline.last) this.seek(timeline.first);
    this.playing.value = !this.playing.peek();
  }

  /** Lets `elapsed_s` of watching pass; true while there is more to come. */
  advance(elapsed_s: number): boolean {
    const timeline = this.timeline.peek();
    if (!this.playing.peek() || timeline === null) return false;
    this.#at_s += elapsed_s * this.speed.peek();
    let next = this.frame.peek();
    while (next < timeline.last && this.timeOf(next + 1) <= this.#at_s) next += 1;
    this.frame.value = next;
    if (next >= timeline.last) this.playing.value = false;
    return this.playing.peek();
  }

  /** One frame at a time: what is wanted meanwhile replaces what was. */
  async #load(): Promise<void> {
    const recording = this.recording.peek();
    const wantedByViews = this.frames.wanted.peek();
    const products = wantedByViews.length === 0 ? LEAST_PRODUCTS : wantedByViews;
    if (recording === null || this.loader === null || this.#loading) return;
    const frame = this.frame.peek();
    const path = `${recordingPath(recording.id)}/frames/${frame}${this.settings.peek() === "current" ? "?reconstruction=current" : ""}`;
    const wanted = [path, ...products, this.#recomputed].join();
    if (this.#loaded === wanted) return;
    this.#loading = true;
    try {
      const reports = await this.loader(path, products);
      if (this.recording.peek()?.id === recording.id) this.#show(frame, path, reports);
    } catch (error) {
      const { message } = refusalIn(error);
      if (this.recording.peek()?.id === recording.id) {
        this.trouble.value = message;
        this.playing.value = false;
      }
    } finally {
      this.#loading = false;
    }
    this.#loaded = wanted;
    if (this.recording.peek() !== null) await this.#load();
  }

  #show(frame: number, path: string, reports: readonly FrameReport[]): void {
    batch(() => {
      this.trouble.value = null;
      for (const report of reports) this.frames.put(frameOf(report, path));
      this.shown.value = frame;
      const meta = reports.at(-1)?.message.meta;
      if (meta !== undefined)
        this.status.frameReplayed(
          meta,
          reports.reduce((sum, { message }) => sum + message.encode_s, 0),
        );
    });
  }

  #read(of: string): Promise<[RecordingDocument, TimelineDocument]> {
    return Promise.all([this.api.ask("GET /recordings/{recording}", { of }), this.api.ask("GET /recordings/{recording}/frames", { of })]);
  }

  /** A recording that is still being written has more frames by and by. */
  #watchGrowth(): void {
    clearTimeout(this.#timer);
    if (this.recording.peek()?.state !== "recording") return;
    this.#timer = setTimeout(() => void this.#grow(), GROWS_MS);
  }

  async #grow(): Promise<void> {
    const id = this.recording.peek()?.id;
    if (id === undefined) return;
    try {
      const [recording, timeline] = await this.#read(id);
      if (this.recording.peek()?.id !== id) return;
      batch(() => {
        this.recording.value = recording;
        if (hasFrames(timeline)) this.timeline.value = timeline;
      });
    } catch (error) {
      refusalIn(error);
    }
    this.#watchGrowth();
  }
}

function hasFrames(timeline: TimelineDocument): timeline is Timeline {
  return timeline.first !== null && timeline.last !== null;
}
