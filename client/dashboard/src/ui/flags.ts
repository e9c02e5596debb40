/** What a pixel says about itself: the bits of the product `flags`, their names at the service, and words. */

export interface Flag {
  readonly bit: number;
  /** As the service calls it. */
  readonly name: string;
  readonly title: string;
  readonly words: string;
  /** A colour that is told from the others' by colour-blind eyes too (after Okabe and Ito). */
  readonly colour: string;
}

/** The gravest first: a pixel with several is shown by the first. */
export const FLAGS: readonly Flag[] = [
  { bit: 8, name: "non_finite", title: "Not finite", words: "a moment is not a number, or too large", colour: "#cc79a7" },
  { bit: 2, name: "no_signal", title: "No signal", words: "no light came back", colour: "#1b2a6b" },
  { bit: 4, name: "saturated", title: "Saturated", words: "an image was at the end of its scale", colour: "#d55e00" },
  { bit: 32, name: "replaced", title: "Replaced", words: "a bad pixel that shows the mean of its neighbours", colour: "#e6c700" },
  { bit: 16, name: "degenerate", title: "Degenerate", words: "the moments do not determine a density", colour: "#009e73" },
  { bit: 1, name: "biased", title: "Biased", words: "the moments contradicted each other, or left no even light, and were moved to the nearest possible ones", colour: "#56a9dc" },
]; // prettier-ignore

/** The gravest flag of a pixel; null where nothing was wrong. */
export function gravest(bits: number): Flag | null {
  return FLAGS.find(({ bit }) => (bits & bit) !== 0) ?? null;
}
