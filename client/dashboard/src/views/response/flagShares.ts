/** Which flags a pixel carried lately, and how often: one look at a time would flicker between two truths. */
import type { PixelDocument } from "../../stream/documents";
import { Looks } from "./looks";

export interface FlagShare {
  readonly name: string;
  /** Share of the looks that the pixel carried it in, 0 to 1. */
  readonly share: number;
}

/** The flags of one pixel over its last looks. */
export class FlagHistory {
  readonly #looks = new Looks<readonly string[]>();

  /** Takes a look, once a frame; another pixel or scene begins anew. */
  take({ x, y, flags, meta }: Pick<PixelDocument, "x" | "y" | "flags" | "meta">, scene = ""): void {
    this.#looks.take([x, y, meta.sequence_id, scene].join(), meta.frame, flags);
  }

  get looks(): number {
    return this.#looks.all.length;
  }

  /** Flags of any of the looks. */
  shares(): readonly FlagShare[] {
    const { all } = this.#looks;
    return [...new Set(all.flat())].map((name) => ({ name, share: all.filter((flags) => flags.includes(name)).length / all.length }));
  }
}
