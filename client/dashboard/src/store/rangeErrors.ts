/** How far the range of the median pixel is off, as one figure for the whole page. */
import { computed, effect, type ReadonlySignal, signal, untracked } from "@preact/signals";

import type { FrameMeta } from "../stream/documents";
import { LIVE, RequestError } from "./api";
import type { Frames } from "./frames";
import type { FrameLoader } from "./replay";
import type { Status } from "./status";

export interface RangeErrorFigure {
  readonly error_m: number;
  /** What it holds: 1 σ of the noise and the bias together, or the noise alone where the bias is unknown. */
  readonly of: "noise and bias" | "noise";
}

/** How long a sequence stays before its error is requested, and how often it is requested again. */
const SETTLED_MS = 2000;
const AGAIN_MS = 30_000;
const PRODUCT = "range_error";

/**
 * The error of the range now. The service computes it for a frame of which it was requested, at the cost of 0.1 s for
 * 163 x 120 pixels: this page requests it for a frame in 30 s, beside the stream, which would wait for it.
 */
export class RangeErrors {
  /** Null before a range was computed. */
  readonly now: ReadonlySignal<RangeErrorFigure | null>;
  /** Set by what talks to the worker. */
  loader: FrameLoader | null = null;
  /** The last statement of noise and bias, and for which sequence. */
  readonly #stated = signal<{ readonly sequence_id: number; readonly error_m: number } | null>(null);
  readonly #scene = signal(0);
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(frames: Frames, status: Status, replaying: ReadonlySignal<boolean>) {
    this.now = computed(() => {
      const meta = status.newest.value;
      const stated = this.#stated.value;
      if (meta !== null && stated !== null && stated.sequence_id === meta.sequence_id && !replaying.value)
        return { error_m: stated.error_m, of: "noise and bias" };
      const own_m = meta?.accuracy?.range_error_m;
      if (own_m != null) return { error_m: own_m, of: "noise and bias" };
      const noise_m = meta?.predicted_range_std_m?.median;
      return noise_m === undefined ? null : { error_m: noise_m, of: "noise" };
    });
    effect(() => {
      const shown = frames.of(PRODUCT).value;
      if (shown !== null && shown.origin === LIVE) untracked(() => this.#take(shown.meta));
    });
    const live = computed(() =>
      status.connection.value.kind === "open" && !replaying.value ? (status.newest.value?.sequence_id ?? null) : null,
    );
    effect(() => {
      void this.#scene.value;
      clearTimeout(this.#timer);
      if (live.value !== null) this.#timer = setTimeout(() => void this.#request(), SETTLED_MS);
    });
  }

  /** The camera stands before another scene: what was stated is of the one before. */
  sceneChanged(): void {
    this.#stated.value = null;
    this.#scene.value += 1;
  }

  #take({ sequence_id, accuracy }: FrameMeta): void {
    if (accuracy?.range_error_m != null) this.#stated.value = { sequence_id, error_m: accuracy.range_error_m };
  }

  async #request(): Promise<void> {
    const timer = this.#timer;
    try {
      for (const { message } of (await this.loader?.(LIVE, [PRODUCT])) ?? []) this.#take(message.meta);
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      return; // a camera without this figure; with the next sequence it is requested again
    }
    if (this.#timer === timer) this.#timer = setTimeout(() => void this.#request(), AGAIN_MS);
  }
}
