import { batch, effect, type ReadonlySignal, signal, untracked } from "@preact/signals";

import type { PixelDocument } from "../stream/documents";
import { frameUrl } from "../stream/frameUrl";
import { type Api, LIVE, liveFrame, refusalIn } from "./api";
import type { Frame } from "./frames";
import type { Pixel } from "./pixel";

/** Least time between two questions about the same pixel. */
const PAUSE_S = 0.5;

/**
 * What only the service knows of a pixel, asked for again as frames come: one question at a time, and few.
 */
export class Details {
  readonly document = signal<PixelDocument | null>(null);
  /** The frame on screen that it was asked of, so that all that is shown of the pixel is of one frame. */
  readonly frame = signal<Frame | null>(null);
  #place: Pixel | null = null;
  #newest: Frame | null = null;
  /** Where the frame is that the document is about, or that was last asked for. */
  #origin: string = LIVE;
  #asking = false;
  #asked_s = -Infinity;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly api: Api,
    private readonly now_s: () => number = () => performance.now() / 1000,
  ) {}

  /** Keeps what is known of `pixel` as new as `frame`; the answer ends it. */
  follow(pixel: ReadonlySignal<Pixel | null>, frame: ReadonlySignal<Frame | null>): () => void {
    const end = effect(() => {
      [this.#place, this.#newest] = [pixel.value, frame.value];
      untracked(() => void this.#look());
    });
    return () => {
      end();
      clearTimeout(this.#timer);
    };
  }

  /** What is known is of another scene, pixel or sequence than what is on screen. */
  forget(): void {
    batch(() => ([this.document.value, this.frame.value] = [null, null]));
  }

  async #look(): Promise<void> {
    const [place, newest] = [this.#place, this.#newest];
    const known = this.document.peek();
    const sourceChanged = newest !== null && (newest.origin === LIVE) !== (this.#origin === LIVE);
    const sequenceChanged = newest !== null && newest.meta.sequence_id !== known?.meta.sequence_id;
    const same = known !== null && known.x === place?.x && known.y === place.y && !sourceChanged && !sequenceChanged;
    if (!same) this.forget();
    if (place === null || newest === null || this.#asking) return;
    if (place.x >= newest.meta.width || place.y >= newest.meta.height) return;
    if (same) {
      const isOld = newest.origin === LIVE ? known.meta.frame < newest.meta.frame : this.#origin !== newest.origin;
      if (!isOld || this.#waits()) return;
    }
    this.#asking = true;
    this.#asked_s = this.now_s();
    this.#origin = newest.origin;
    try {
      const answer = await this.#ask(place, newest);
      const asked = this.#place?.x === answer.x && this.#place.y === answer.y;
      if (asked && this.#newest?.meta.sequence_id === answer.meta.sequence_id)
        batch(() => ([this.document.value, this.frame.value] = [answer, newest]));
    } catch (error) {
      refusalIn(error);
      this.forget(); // asked again with the next frame
    } finally {
      this.#asking = false;
    }
    if (this.#place?.x !== place.x || this.#place.y !== place.y || this.#newest?.origin !== newest.origin) await this.#look();
  }

  /** Asks about the very frame that is shown, as long as the service keeps it: it may be held here. */
  async #ask({ x, y }: Pixel, { origin, meta }: Frame): Promise<PixelDocument> {
    if (origin !== LIVE) return this.#pixel(x, y, origin);
    try {
      return await this.#pixel(x, y, liveFrame(meta.frame));
    } catch (error) {
      if (!refusalIn(error).isGone) throw error;
      return this.#pixel(x, y, LIVE);
    }
  }

  /** Everything about one pixel of a frame but its curves, which the page computes itself. */
  #pixel(x: number, y: number, frame: string): Promise<PixelDocument> {
    return this.api.ask("GET /frames/{frame}/pixel", { at: frameUrl(frame, `pixel?x=${x}&y=${y}&bins=1`) });
  }

  /** Whether it is too soon to ask again; if so, it is asked when it is not: no other frame may come. */
  #waits(): boolean {
    const left_s = PAUSE_S - (this.now_s() - this.#asked_s);
    clearTimeout(this.#timer);
    if (left_s <= 0) return false;
    this.#timer = setTimeout(() => void this.#look(), 1000 * left_s);
    return true;
  }
}
