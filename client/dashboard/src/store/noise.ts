/** How much each pixel scatters from frame to frame: measured, for any camera and any cause. */
import { effect, signal, untracked } from "@preact/signals";

import type { Frame, Frames } from "./frames";

/** Frames that count; older ones fade. */
export const WINDOW = 30;
/** Fewest frames that a deviation is computed from. */
export const FEWEST = 5;

/**
 * Running standard deviation of every pixel of one product over frames.
 *
 * The first `WINDOW` frames count alike, so that the deviation is that of the sample; after that a frame counts 1 / WINDOW
 * and older ones fade exponentially (West 1979). The sum of the squared weights makes it free of bias for
 * independent frames.
 */
export class Noise {
  /** Frames taken since the last change of what is measured. */
  readonly frames = signal(0);
  #key = "";
  #mean = new Float32Array(0);
  #square = new Float32Array(0);
  #count = new Uint16Array(0);

  take({ values, shape, meta, origin }: Pick<Frame, "values" | "shape" | "meta" | "origin">, scene = ""): void {
    // Another sequence, calibration, recording or scene: something else is measured.
    const key = [shape.join("x"), meta.sequence_id, meta.calibration_id, origin.split("/frames/")[0], scene].join();
    if (key !== this.#key) {
      this.#key = key;
      this.#mean = new Float32Array(values.length);
      this.#square = new Float32Array(values.length);
      this.#count = new Uint16Array(values.length);
      this.frames.value = 0;
    }
    for (let at = 0; at < values.length; at++) {
      const value = values[at];
      if (!Number.isFinite(value)) continue;
      const count = Math.min(MOST, this.#count[at] + 1);
      this.#count[at] = count;
      const weight = 1 / Math.min(count, WINDOW);
      const difference = value - this.#mean[at];
      this.#mean[at] += weight * difference;
      this.#square[at] = (1 - weight) * (this.#square[at] + weight * difference * difference);
    }
    this.frames.value = this.frames.peek() + 1;
  }

  /** Standard deviation of a pixel, by its place in the map; NaN before enough frames had a value there. */
  std(at: number): number {
    const count = this.#count[at] ?? 0;
    return count < FEWEST ? NaN : Math.sqrt(this.#square[at] / (1 - squaredWeights(count)));
  }
}

/** Counts beyond this change the sum of squared weights no more. */
const MOST = 500;

/** Sum of the squared weights of a count of frames: alike at first; then each new one weighs 1 / WINDOW, and those before it the rest. */
function squaredWeights(count: number): number {
  if (count <= WINDOW) return 1 / count;
  const limit = 1 / (2 * WINDOW - 1);
  return limit + (1 / WINDOW - limit) * (1 - 1 / WINDOW) ** (2 * (count - WINDOW));
}

/** The noise of products, each measured from when it is first asked for, as frames come. */
export class Noises {
  readonly #all = new Map<string, Noise>();

  constructor(private readonly frames: Frames) {}

  of(product: string): Noise {
    const known = this.#all.get(product);
    if (known !== undefined) return known;
    const noise = new Noise();
    this.#all.set(product, noise);
    const newest = this.frames.of(product);
    effect(() => {
      const frame = newest.value;
      if (frame !== null) untracked(() => noise.take(frame, this.frames.sceneOf(frame.meta)));
    });
    return noise;
  }
}
