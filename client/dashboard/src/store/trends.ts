/** How the flow of frames went over the last minute. */
import { effect, signal, untracked } from "@preact/signals";

import type { RangeErrors } from "./rangeErrors";
import { CREDIBLE_LATENCY_S, type Status } from "./status";

/** How long samples are kept, and how far apart they are at least. */
export const KEPT_S = 60;
const APART_S = 0.5;
/** Samples further apart than this have a time without frames between them. */
const GAP_S = 5;

/** The figures that are followed; NaN where one is not known. */
export interface Sample {
  readonly at_s: number;
  readonly rate_hz: number;
  /** Error of the range in the median pixel. */
  readonly error_m: number;
  readonly latency_s: number;
  /** Frames left out for this page since the sample before. */
  readonly dropped: number;
}

export type Trend = Exclude<keyof Sample, "at_s">;

export class Trends {
  /** By rising time. */
  readonly samples = signal<readonly Sample[]>([]);
  #counted = 0;

  constructor(status: Status, rangeErrors: RangeErrors) {
    effect(() => {
      const { last_s, rate_hz, latency_s } = status.flow.value;
      if (last_s === null) return;
      untracked(() => {
        this.#take(last_s, status.dropped.value, {
          rate_hz: rate_hz ?? NaN,
          error_m: rangeErrors.now.value?.error_m ?? NaN,
          // What the clocks of service and page differ by is no latency.
          latency_s: latency_s === null || latency_s < 0 || latency_s > CREDIBLE_LATENCY_S ? NaN : latency_s,
        });
      });
    });
  }

  #take(at_s: number, dropped: number, figures: Omit<Sample, "at_s" | "dropped">): void {
    const kept = this.samples.peek();
    if (at_s - (kept.at(-1)?.at_s ?? -Infinity) < APART_S) return;
    // A new session counts from nothing.
    const since = dropped >= this.#counted ? dropped - this.#counted : dropped;
    this.#counted = dropped;
    this.samples.value = [...kept.filter((sample) => sample.at_s > at_s - KEPT_S), { at_s, dropped: since, ...figures }];
  }
}

/** A place in a plot, in shares of its width from the left and of its height from the foot. */
export type PlotPoint = Readonly<{ x: number; y: number }>;

/** The lines of a figure over the last minute, the newest sample at the right; broken where it is not known. Its height is from zero to `most`. */
export function linesOf(
  samples: readonly Sample[],
  trend: Trend,
): { readonly most: number; readonly lines: readonly (readonly PlotPoint[])[] } {
  const values = samples.map((sample) => sample[trend]);
  const most = Math.max(0, ...values.filter(Number.isFinite));
  const end_s = samples.at(-1)?.at_s ?? 0;
  const lines: PlotPoint[][] = [];
  let before_s = -Infinity;
  samples.forEach(({ at_s }, n) => {
    if (!Number.isFinite(values[n])) return;
    if (at_s - before_s > GAP_S || !Number.isFinite(values[n - 1])) lines.push([]);
    before_s = at_s;
    lines[lines.length - 1].push({ x: 1 - (end_s - at_s) / KEPT_S, y: most === 0 ? 0 : values[n] / most });
  });
  return { most, lines };
}
