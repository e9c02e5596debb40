/** How fluently light moves on the screen, counted while it plays or is scrubbed. */

/** Time that is counted over. */
const WINDOW_S = 2;
/** After so long without a refresh nobody saw the page: the machine slept. */
const ASLEEP_S = 5;

/** Counts pictures; times are of any one clock. */
export class Fluency {
  #began_s: number | null = null;
  #last_s = 0;
  #pictures = 0;

  /** Nothing moves, nobody looks, or something else is asked for: counting begins anew. */
  restart(): void {
    this.#began_s = null;
  }

  /** The screen is refreshed while light moves; answers refreshes a second when it was counted long enough. */
  refreshed(now_s: number): number | null {
    const asleep = now_s - this.#last_s > ASLEEP_S;
    this.#last_s = now_s;
    if (this.#began_s === null || asleep) {
      [this.#began_s, this.#pictures] = [now_s, 0];
      return null;
    }
    this.#pictures += 1;
    const span_s = now_s - this.#began_s;
    if (span_s < WINDOW_S) return null;
    const pictures_hz = this.#pictures / span_s;
    [this.#began_s, this.#pictures] = [now_s, 0];
    return pictures_hz;
  }
}
