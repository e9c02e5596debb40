/** How fluently light moves on the screen, counted while it plays or is scrubbed. */

export interface FluencyReport {
  /** Refreshes of the screen a second. */
  readonly pictures_hz: number;
  /** Frames taken from the stream a second, and those that the camera took. */
  readonly frames_hz: number;
  readonly camera_hz: number;
}

/** Time that is counted over. */
const WINDOW_S = 2;
/** After so long without a refresh nobody saw the page: the machine slept. */
const ASLEEP_S = 5;

/** Counts pictures and frames; times are of any one clock. */
export class Fluency {
  #began_s: number | null = null;
  #last_s = 0;
  #pictures = 0;
  #frames = 0;
  /** Numbers of the newest frame now, and when counting began. */
  #newest = 0;
  #oldest = 0;

  /** Nothing moves, nobody looks, or something else is asked for: counting begins anew. */
  restart(): void {
    this.#began_s = null;
  }

  frameTaken(number: number): void {
    this.#frames += 1;
    this.#newest = number;
  }

  /** The screen is refreshed while light moves; answers what was counted when it was long enough. */
  refreshed(now_s: number): FluencyReport | null {
    if (this.#began_s === null || now_s - this.#last_s > ASLEEP_S) {
      this.#begin(now_s);
      return null;
    }
    this.#last_s = now_s;
    this.#pictures += 1;
    const span_s = now_s - this.#began_s;
    if (span_s < WINDOW_S) return null;
    const report = {
      pictures_hz: this.#pictures / span_s,
      frames_hz: this.#frames / span_s,
      camera_hz: Math.max(this.#frames, this.#newest - this.#oldest) / span_s,
    };
    this.#begin(now_s);
    return report;
  }

  #begin(now_s: number): void {
    this.#began_s = this.#last_s = now_s;
    this.#pictures = this.#frames = 0;
    this.#oldest = this.#newest;
  }
}
