/** Which flags a pixel carried lately, and how often: one look at a time would flicker between two truths. */
import type { PixelDocument } from "../../stream/documents";

/** Looks that count. */
export const LOOKS = 30;

export interface FlagShare {
  readonly name: string;
  /** Share of the looks that the pixel carried it in, 0 to 1. */
  readonly share: number;
}

/** The flags of one pixel over its last looks. */
export class FlagHistory {
  #place = "";
  #frame = NaN;
  #looks: (readonly string[])[] = [];

  /** Takes a look, once a frame; another pixel or scene begins anew. */
  take({ x, y, flags, meta }: Pick<PixelDocument, "x" | "y" | "flags" | "meta">, scene = ""): void {
    const place = `${x},${y},${meta.sequence_id},${scene}`;
    if (place !== this.#place) [this.#place, this.#looks, this.#frame] = [place, [], NaN];
    if (meta.frame === this.#frame) return;
    this.#frame = meta.frame;
    this.#looks = [...this.#looks.slice(1 - LOOKS), flags];
  }

  get looks(): number {
    return this.#looks.length;
  }

  /** Flags of any of the looks. */
  shares(): readonly FlagShare[] {
    const names = new Set(this.#looks.flat());
    return [...names].map((name) => ({ name, share: this.#looks.filter((flags) => flags.includes(name)).length / this.#looks.length }));
  }
}
