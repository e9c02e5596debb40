import { batch } from "@preact/signals";

/** Work done before the display refreshes; true asks for the next refresh too. */
export type Step = (elapsed_s: number) => boolean;

/**
 * The page's one animation loop: everything that changes with time changes here, in one batch, so that
 * each picture is drawn at most once a refresh. It sleeps while nothing moves.
 */
export class AnimationLoop {
  readonly #steps: Step[] = [];
  #asleep = true;
  #last_ms: number | null = null;

  constructor(private readonly request: (callback: (now_ms: number) => void) => number) {}

  add(step: Step): void {
    this.#steps.push(step);
  }

  /** Runs the steps before the next refresh. */
  wake(): void {
    if (!this.#asleep) return;
    this.#asleep = false;
    this.request(this.#refresh);
  }

  readonly #refresh = (now_ms: number): void => {
    // After a pause (a hidden page, a sleeping loop) time starts anew instead of jumping.
    const elapsed_s = this.#last_ms === null ? 0 : Math.min(0.1, (now_ms - this.#last_ms) / 1000);
    let more = false;
    this.#asleep = true; // a step that wakes the loop asks for the next refresh
    batch(() => {
      for (const step of this.#steps) more = step(elapsed_s) || more;
    });
    this.#last_ms = more ? now_ms : null;
    if (more) this.wake();
  };
}
