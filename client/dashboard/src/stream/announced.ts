/**
 * Products of frames that the stream announces and requests bring: browsers take large answers several times cheaper
 * than large messages.
 *
 * One is requested at a time. Those of a frame that was begun are brought first, then those of the newest frame;
 * frames between are left out, as the stream does for a page that is slow.
 */

/** A product of a frame. */
export type Announcement = Readonly<{ frame: number; product: string }>;

export class Announced {
  #waiting: Announcement[] = [];
  /** The frame that was begun. */
  #frame = 0;
  /** The newest frame, and how many of its products are not announced yet. */
  #newest = 0;
  #lacking = 0;
  #busy = false;
  /** The frame that is being requested. */
  #bringing: number | null = null;
  /** Counts what began anew: what was requested before is not wanted any more. */
  #round = 0;

  constructor(
    private readonly bring: (announcement: Announcement) => Promise<ArrayBuffer>,
    private readonly take: (body: ArrayBuffer) => void,
    private readonly miss: (announcement: Announcement, error: unknown) => void,
  ) {}

  /** Brings a product of a frame of which so many are announced. */
  add(announcement: Announcement, products: number): void {
    if (announcement.frame !== this.#newest) [this.#newest, this.#lacking] = [announcement.frame, products];
    this.#lacking -= 1;
    this.#waiting.push(announcement);
    if (!this.#busy) void this.#bringAll();
  }

  /** The newest frame of which, and of those before, nothing is still to come. */
  get done(): number {
    const lacking = this.#lacking > 0 ? this.#newest : Infinity;
    return Math.min(lacking, this.#bringing ?? Infinity, ...this.#waiting.map(({ frame }) => frame)) - 1;
  }

  /** Something else is asked for, or the connection is gone: nothing of before is brought any more. */
  clear(): void {
    this.#waiting = [];
    this.#busy = false;
    this.#bringing = null;
    this.#lacking = 0;
    this.#round += 1;
  }

  async #bringAll(): Promise<void> {
    const round = this.#round;
    this.#busy = true;
    for (let next = this.#next(); next !== undefined; next = this.#next()) {
      this.#bringing = next.frame;
      const brought = await this.bring(next).catch((error: unknown) => error);
      if (round !== this.#round) return;
      this.#bringing = null;
      if (brought instanceof ArrayBuffer) this.take(brought);
      else this.miss(next, brought);
      if (round !== this.#round) return; // what came of it was that something else is asked for
    }
    this.#busy = false;
  }

  #next(): Announcement | undefined {
    if (!this.#waiting.some(({ frame }) => frame === this.#frame)) {
      this.#frame = Math.max(...this.#waiting.map(({ frame }) => frame));
      this.#waiting = this.#waiting.filter(({ frame }) => frame === this.#frame);
    }
    const at = this.#waiting.findIndex(({ frame }) => frame === this.#frame);
    return at < 0 ? undefined : this.#waiting.splice(at, 1)[0];
  }
}
