/** What a pixel says about itself: the bits of the product `flags`, their names at the service, and words. */

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
export const FLAGS: readonly Flag[] = [
  { bit: 4, name: "saturated", title: "Saturated", words: "an image was at the end of its scale", colour: "#e69f00" },
  { bit: 8, name: "non_finite", title: "Not finite", words: "a moment is not a number, or too large", colour: "#cc79a7" },
  { bit: 2, name: "no_signal", title: "No signal", words: "no light above the noise came back", colour: "#1b2a6b" },
  {
    bit: 64,
    name: "contradictory",
    title: "Contradictory",
    words: "something is wrong: the moments contradict each other by more than noise explains, as after drift or where something moved",
    colour: "#d55e00",
  },
  {
    bit: 128,
    name: "unexplained",
    title: "Unexplained",
    words: "the returns found do not explain the moments: the range may be biased",
    colour: "#56b4e9",
  },
  { bit: 32, name: "replaced", title: "Replaced", words: "a bad pixel that shows the mean of its neighbours", colour: "#f0e442" },
  {
    bit: 16,
    name: "degenerate",
    title: "Degenerate",
    words: "the moments do not determine a density, or another range fits nearly as well",
    colour: "#009e73",
  },
  {
    bit: 1,
    name: "biased",
    title: "Biased",
    words: "normal: sharp returns or noise left no even light, and the moments were moved to the nearest that have some",
    colour: "#7f93a3",
  },
];

/** Why a range is not trusted: the codes of the product `trust`. */
export const DISTRUST: readonly Flag[] = [
  { bit: 1, name: "no_range", title: "No range", words: "there is none: too little light, or too much", colour: "#1b2a6b" },
  { bit: 2, name: "corrupt_image", title: "Corrupt image", words: "an image was lost or out of step", colour: "#cc79a7" },
  { bit: 3, name: "motion", title: "Motion", words: "the light changed while the frame was captured", colour: "#f0e442" },
  { bit: 4, name: "no_direct_light", title: "No direct light", words: "too bright for this range: light came around", colour: "#d55e00" },
  { bit: 5, name: "shadow", title: "Shadow", words: "what is nearer hides this point from the lamp", colour: "#7f93a3" },
  { bit: 6, name: "edge", title: "Edge", words: "near and far meet here", colour: "#56b4e9" },
  { bit: 7, name: "later_light_unresolved", title: "Merged light", words: "later light is merged with the first", colour: "#e69f00" },
  { bit: 8, name: "later_light", title: "Later light", words: "a return close behind may have moved the first", colour: "#009e73" },
  { bit: 9, name: "drift", title: "Drift", words: "the camera is much warmer or colder than at its calibration", colour: "#b8860b" },
  { bit: 10, name: "noise", title: "Noise", words: "the noise leaves the range open", colour: "#a0522d" },
];

/** What has to be known for a reason to be judged, where that may be missing. */
export const NEEDS: Readonly<Record<string, string>> = {
  no_direct_light: "the beam of the light, which “transientcam calibrate URL --beam” measures before a white wall",
  shadow: "the place of the light beside the lens, in the settings “lens”",
  motion: "the images of the frame",
  drift: "a calibration that was measured, with its temperature",
};

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
