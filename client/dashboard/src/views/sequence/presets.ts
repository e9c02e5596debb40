/** Sequences to begin with. */
import type { SequenceDocument } from "../../stream/documents";

export interface Preset {
  readonly name: string;
  /** What it is good for. */
  readonly words: string;
  /** What of a sequence it sets. */
  readonly sequence: Pick<SequenceDocument, "base_frequency_hz" | "harmonics" | "zeroth" | "exposure_s" | "takes">;
}

export function presetOf(name: string): Preset | undefined {
  return PRESETS.find((preset) => preset.name === name);
}

/** Measured in docs/measured/default-sequence.md and docs/accuracy.md. */
export const PRESETS: readonly Preset[] = [
  {
    name: "Default",
    words: "two and three returns in a tenth of a second",
    sequence: { base_frequency_hz: 23e6, harmonics: 4, zeroth: "estimated", exposure_s: 1.92e-3, takes: 1 },
  },
  {
    name: "Video",
    words: "the paper's, 18.6 Hz",
    sequence: { base_frequency_hz: 23e6, harmonics: 3, zeroth: "estimated", exposure_s: 0.5e-3, takes: 1 },
  },
  {
    name: "One frequency",
    words: "the phase of an ordinary lidar: fast, and biased by all indirect light",
    sequence: { base_frequency_hz: 23e6, harmonics: 1, zeroth: "estimated", exposure_s: 1.92e-3, takes: 1 },
  },
  {
    name: "Thin front of light",
    words: "six harmonics and eight takes, for films: a second for a frame",
    sequence: { base_frequency_hz: 20e6, harmonics: 6, zeroth: "estimated", exposure_s: 1.5e-3, takes: 8 },
  },
];
