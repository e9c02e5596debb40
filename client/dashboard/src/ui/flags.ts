/** What a pixel says about itself: the bits of the product `flags`, their names at the service, and words. */
import stated from "./flags.json";

export interface Flag {
  /** Its bit, or its code where a pixel has one alone. */
  readonly bit: number;
  /** As the service calls it. */
  readonly name: string;
  readonly title: string;
  readonly words: string;
  /** A colour distinct from the others' for colour-blind eyes too (after Okabe and Ito). */
  readonly colour: string;
}

/** The gravest first: a pixel with several is shown by the first. */
export const FLAGS: readonly Flag[] = stated.flags;

/** Why a range is not trusted: the codes of the product `trust`. */
export const DISTRUST: readonly Flag[] = stated.distrust;

/** What has to be known for a reason to be judged, where that may be missing. */
export const NEEDS: Readonly<Record<string, string>> = stated.needs;

/** What could not be judged of a frame, and what would let it be, in words; "" where all was. */
export function notJudgedWords(names: readonly string[] = []): string {
  const missing = DISTRUST.filter(({ name }) => names.includes(name));
  const words = missing.map(({ name, title }) => `${title.toLowerCase()} (needs ${NEEDS[name]})`).join(", ");
  return words && `not judged: ${words}`;
}

/** The gravest flag of a pixel; null where nothing was wrong. */
export function gravest(bits: number): Flag | null {
  return FLAGS.find(({ bit }) => (bits & bit) !== 0) ?? null;
}
