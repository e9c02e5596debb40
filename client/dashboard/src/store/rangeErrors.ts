/** What the ranges of a picture and of each pixel are worth, as one statement for the whole page. */
import { computed, effect, type ReadonlySignal, type Signal, signal } from "@preact/signals";

import type { FrameMeta } from "../stream/documents";
import { LIVE, liveFrame, refusalIn } from "./api";
import { type Frame, type Frames, frameOf } from "./frames";
import type { Pixel } from "./pixel";
import type { FrameLoader } from "./replay";
import type { Status } from "./status";

export interface RangeErrorFigure {
  /** Of the median pixel. */
  readonly error_m: number;
  /** Half of the 90 % interval, of noise and bias; or 1 σ of the noise alone where the bias is unknown. */
  readonly of: "interval" | "noise";
  /** 1 σ of noise and bias together, which plans predict: what this is held against them by. */
  readonly planned_m: number;
  /** Share of the picture that is trusted; null where that is not known. */
  readonly trusted_share: number | null;
  /** Half of the interval that 9 of 10 trusted pixels have, or less. */
  readonly within_m: number | null;
  /** Reasons for distrust, by name, that nothing known would tell: `trusted_share` counts their pixels. */
  readonly not_judged?: readonly string[];
}

/** Noise and bias of a frame's median pixel together, as plans state them: half of an interval is more. Null if unknown. */
export function plannedError_m(accuracy: FrameMeta["accuracy"] | null): number | null {
  return accuracy?.range_std_m == null || accuracy.range_bias_m == null ? null : Math.hypot(accuracy.range_std_m, accuracy.range_bias_m);
}

/** What is requested of a frame; the first one is its error. */
const PRODUCTS = ["range_error", "range_std", "range_bias", "trust"] as const;
export type ErrorProduct = (typeof PRODUCTS)[number];

/** How long what is shown stays before its errors are requested: while frames come, and where they do not. */
const SETTLED_MS = 2000;
const STILL_MS = 100;
/** The least pause before they are requested again, and so many times as long as the request took. */
const AGAIN_MS = 3000;
const SHARE_OF_TIME = 20;

/**
 * The errors of the range now. The service computes them for a frame of which they were requested, at the cost of 0.1 s
 * for 163 x 120 pixels: this page requests them beside the stream, which would wait for them, of few of its frames; of
 * one that is held or replayed, of that very frame.
 */
export class RangeErrors {
  /** Null before a range was computed. */
  readonly now: ReadonlySignal<RangeErrorFigure | null>;
  /** Set by what talks to the worker. */
  loader: FrameLoader | null = null;
  readonly #of: ReadonlyMap<ErrorProduct, ReadonlySignal<Frame | null>>;
  readonly #brought: Signal<readonly Frame[]> = signal([]);
  readonly #scene = signal(0);
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly frames: Frames,
    status: Status,
    replaying: ReadonlySignal<boolean>,
    held: ReadonlySignal<boolean>,
  ) {
    const still = computed(() => replaying.value || held.value);
    /** Whether what is known of one frame holds for the one on screen. */
    const holds = (meta: FrameMeta): boolean => {
      const shown = status.newest.value;
      return shown?.sequence_id === meta.sequence_id && (!still.value || shown.frame === meta.frame);
    };
    this.#of = new Map(
      PRODUCTS.map((product) => [
        product,
        computed(() => {
          const known = [frames.of(product).value, ...this.#brought.value];
          return known.find((each) => each?.product === product && holds(each.meta)) ?? null;
        }),
      ]),
    );
    this.now = computed(() => {
      const meta = status.newest.value;
      const accuracy = this.of(PRODUCTS[0]).value?.meta.accuracy ?? meta?.accuracy;
      const share = {
        trusted_share: accuracy?.trusted_share ?? null,
        within_m: accuracy?.within_m ?? null,
        not_judged: accuracy?.not_judged ?? [],
      };
      const planned_m = plannedError_m(accuracy ?? null) ?? NaN;
      if (accuracy?.range_error_m != null) return { error_m: accuracy.range_error_m, of: "interval", planned_m, ...share };
      const noise_m = accuracy?.range_std_m ?? meta?.predicted_range_std_m?.median;
      return noise_m == null ? null : { error_m: noise_m, of: "noise", planned_m: noise_m, ...share };
    });
    const shown = computed(() => {
      const meta = status.newest.value;
      if (status.connection.value.kind !== "open" || meta === null) return null;
      return still.value ? `${replaying.value} ${meta.frame}` : `live ${meta.sequence_id}`;
    });
    effect(() => {
      void this.#scene.value;
      clearTimeout(this.#timer);
      const again = !still.value;
      if (shown.value !== null) this.#timer = setTimeout(() => void this.#request(status, again), again ? SETTLED_MS : STILL_MS);
    });
  }

  /** A map of errors, or of `trust`, that holds for the frame on screen; null where none is known. */
  of(product: ErrorProduct): ReadonlySignal<Frame | null> {
    return this.#of.get(product) as ReadonlySignal<Frame | null>;
  }

  /** An error at a pixel, in m, or its code of `trust`; NaN where it is not known. */
  at(product: ErrorProduct, { x, y }: Pixel): number {
    const frame = this.of(product).value;
    return frame === null || x >= frame.shape[1] || y >= frame.shape[0] ? NaN : frame.values[y * frame.shape[1] + x];
  }

  /** The camera stands before another scene: what was stated is of the one before. */
  sceneChanged(): void {
    this.#brought.value = [];
    this.#scene.value += 1;
  }

  /** Of the frame that is shown: where one of a recording is, its origin says. */
  async #request(status: Status, again: boolean): Promise<void> {
    const [timer, scene, began_ms] = [this.#timer, this.#scene.peek(), performance.now()];
    const origin = this.frames.of("range").peek()?.origin ?? LIVE;
    const still = origin === LIVE ? liveFrame(status.newest.peek()?.frame ?? 0) : origin;
    try {
      // While frames come, the one on screen may be gone.
      const first = (await this.loader?.(again ? LIVE : still, PRODUCTS.slice(0, 1))) ?? [];
      const path = again ? liveFrame(first[0]?.message.meta.frame ?? 0) : still;
      const reports = [...first, ...((await this.loader?.(path, PRODUCTS.slice(1))) ?? [])];
      // One that was asked for since counts, also where it came before this one.
      if (scene === this.#scene.peek() && timer === this.#timer) this.#brought.value = reports.map((report) => frameOf(report, path));
    } catch (error) {
      // A camera without errors is asked again with its next sequence; a frame may be gone already.
      if (!refusalIn(error).isGone) return;
    }
    const pause_ms = Math.max(AGAIN_MS, SHARE_OF_TIME * (performance.now() - began_ms));
    if (again && this.#timer === timer) this.#timer = setTimeout(() => void this.#request(status, again), pause_ms);
  }
}
