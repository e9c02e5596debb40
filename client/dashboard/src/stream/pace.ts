/**
 * How many frames a second a browser can take that is to move light fluently, too.
 *
 * Where light moves at fewer than 30 pictures a second while frames come, fewer of them are asked for, then parts of
 * them, and more again where there is room. Where that gives no more pictures, something else is slow, and all are
 * asked for.
 */
import type { FluencyReport } from "./fluency";

/** Pictures a second that are fluent, less what counting may miss of 30, and those that leave room for more frames. */
const FLUENT_HZ = 29;
const ROOMY_HZ = 40;
/** Nearly all that this display was seen to show leaves room, too: some show 30 a second. */
const NEARLY = 0.95;
/** Slow windows before fewer frames are asked for; after more was tried, one will do. */
const SLOW_WINDOWS = 2;
/** Share of the frames that is asked for next: by how slow the pictures are, within these. */
const LEAST_STEP = 0.5;
const MOST_STEP = 0.8;
/** Never fewer frames a second than this, or than half of the camera's, but for a browser that takes hardly as many of all. */
const ENOUGH_HZ = 5;
const OF_TAKEN = 0.7;
/** Fewer frames help where they give so many times as many pictures. */
const HELPS = 1.15;
/** Where they did not, they are tried again when pictures are fewer by this. */
const MUCH_SLOWER = 0.8;
/** Each time, so many times as many frames are asked for. */
const RAISE = 1.5;
/** Most fluent windows before more is asked for; twice as many after each time that it was too much. */
const MOST_PATIENCE = 16;

export class PaceControl {
  #maxRate_hz: number | null = null;
  #part = false;
  /** The camera's frames a second; those that were taken, and pictures, while all frames were asked for. */
  #camera_hz = 0;
  #taken_hz = 0;
  #before_hz = 0;
  #best_hz = 0;
  /** Below so many pictures a second fewer frames may help: they did not where there were more. */
  #vain_hz = Infinity;
  #acts = false;
  #slow = 0;
  #calm = 0;
  #patience = 1;
  #raised = false;

  /** Most frames a second to ask for; null for all. */
  get maxRate_hz(): number | null {
    return this.#maxRate_hz;
  }

  /** Whether part of each frame is asked for: what is in sight, or of a whole picture every second pixel. */
  get part(): boolean {
    return this.#part;
  }

  /** The last window was slow, and something is still to be done about it. */
  get acts(): boolean {
    return this.#acts;
  }

  /** Pictures a second while all frames were asked for. */
  get before_hz(): number {
    return this.#before_hz;
  }

  /** Takes what was counted over a window; answers whether what to ask for changed. */
  judge({ pictures_hz, frames_hz, camera_hz }: FluencyReport): boolean {
    if (frames_hz === 0) return false; // whatever is slow, it is not the frames
    this.#best_hz = Math.max(this.#best_hz, pictures_hz);
    this.#camera_hz = camera_hz;
    if (this.#maxRate_hz === null) this.#taken_hz = frames_hz;
    if (pictures_hz >= FLUENT_HZ) return this.#fluent(pictures_hz);
    this.#calm = 0;
    this.#acts = this.#maxRate_hz === null ? pictures_hz < this.#vain_hz : !this.#part;
    this.#slow += 1;
    if (this.#slow < (this.#raised ? 1 : SLOW_WINDOWS)) return false;
    this.#slow = 0;
    return this.#less(pictures_hz, frames_hz);
  }

  #less(pictures_hz: number, frames_hz: number): boolean {
    if (this.#raised) this.#patience = Math.min(MOST_PATIENCE, 2 * this.#patience);
    this.#raised = false;
    if (this.#maxRate_hz === null) {
      if (pictures_hz >= this.#vain_hz) return false;
      this.#before_hz = pictures_hz;
    }
    if (this.#maxRate_hz !== null && this.#maxRate_hz <= this.#least_hz) return this.#smaller(pictures_hz);
    const step = Math.min(MOST_STEP, Math.max(LEAST_STEP, pictures_hz / FLUENT_HZ));
    this.#maxRate_hz = Math.max(this.#least_hz, step * Math.min(frames_hz, this.#maxRate_hz ?? Infinity));
    return true;
  }

  get #least_hz(): number {
    return Math.min(ENOUGH_HZ, this.#camera_hz / 2, OF_TAKEN * this.#taken_hz);
  }

  /** There are no fewer frames to be asked for. */
  #smaller(pictures_hz: number): boolean {
    if (this.#part) return pictures_hz < HELPS * this.#before_hz && this.#giveUp();
    this.#part = true;
    return true;
  }

  #giveUp(): boolean {
    this.#vain_hz = MUCH_SLOWER * this.#before_hz;
    this.#maxRate_hz = null;
    this.#part = false;
    return true;
  }

  /** A fluent window: more is asked for after enough of them with room. */
  #fluent(pictures_hz: number): boolean {
    this.#slow = 0;
    this.#acts = false;
    const roomy = pictures_hz >= ROOMY_HZ || pictures_hz >= NEARLY * this.#best_hz;
    this.#calm = roomy ? this.#calm + 1 : 0;
    if (this.#maxRate_hz === null) {
      // Long fluent with all frames: what was slow is over.
      if (this.#calm >= MOST_PATIENCE) [this.#patience, this.#raised] = [1, false];
      return false;
    }
    if (this.#calm < this.#patience) return false;
    this.#calm = 0;
    this.#raised = true;
    if (this.#part) {
      this.#part = false;
      return true;
    }
    const more_hz = RAISE * this.#maxRate_hz;
    this.#maxRate_hz = more_hz >= this.#camera_hz ? null : more_hz;
    return true;
  }
}
