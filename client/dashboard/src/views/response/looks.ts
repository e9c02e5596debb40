/** Looks that count. */
export const LOOKS = 30;

/** What was seen at one place over the last looks, one a frame. */
export class Looks<T> {
  all: readonly T[] = [];
  #place = "";
  #frame = NaN;

  /** Takes a look; one at another place begins anew. */
  take(place: string, frame: number, seen: T): void {
    if (place !== this.#place) [this.#place, this.all, this.#frame] = [place, [], NaN];
    if (frame === this.#frame) return;
    this.#frame = frame;
    this.all = [...this.all.slice(1 - LOOKS), seen];
  }
}
