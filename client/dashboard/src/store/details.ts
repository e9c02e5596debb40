import { effect, signal, untracked, type ReadonlySignal } from "@preact/signals";

import type { PixelDocument } from "../stream/protocol";
import { type Api, RequestError } from "./api";
import type { Frame } from "./frames";
import type { Pixel } from "./store";

/** Least time between two questions about the same pixel. */
const PAUSE_S = 0.5;

/**
 * What only the service knows of a pixel, asked for again as frames come: one question at a time, and few.
 */
export class Details {
  readonly document = signal<PixelDocument | null>(null);
  readonly #api: Api;
  readonly #now_s: () => number;
  #asking = false;
  #asked_s = -Infinity;

  constructor(api: Api, now_s: () => number = () => performance.now() / 1000) {
    this.#api = api;
    this.#now_s = now_s;
  }

  /** Keeps what is known of `pixel` as new as `frame`; the answer ends it. */
  follow(pixel: ReadonlySignal<Pixel | null>, frame: ReadonlySignal<Frame | null>): () => void {
    return effect(() => {
      const [place, newest] = [pixel.value, frame.value];
      untracked(() => void this.#follow(place, newest, pixel));
    });
  }

  async #follow(place: Pixel | null, newest: Frame | null, pixel: ReadonlySignal<Pixel | null>): Promise<void> {
    const known = this.document.peek();
    const same = known !== null && known.x === place?.x && known.y === place.y;
    if (!same) this.document.value = null;
    if (place === null || newest === null || this.#asking) return;
    if (place.x >= newest.meta.width || place.y >= newest.meta.height) return;
    if (same && (known.meta.frame >= newest.meta.frame || this.#now_s() - this.#asked_s < PAUSE_S)) return;
    this.#asking = true;
    this.#asked_s = this.#now_s();
    try {
      const told = await this.#api.pixel(place.x, place.y);
      const now = pixel.peek();
      if (now?.x === told.x && now.y === told.y) this.document.value = told;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.document.value = null; // asked again with the next frame
    } finally {
      this.#asking = false;
    }
    const now = pixel.peek();
    if (now !== null && (now.x !== place.x || now.y !== place.y)) await this.#follow(now, newest, pixel);
  }
}
