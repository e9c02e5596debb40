/** Sequences to begin with. */
import type { SequenceDocument } from "../../stream/documents";
import presets from "./presets.json";

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
export const PRESETS = presets as readonly Preset[];
