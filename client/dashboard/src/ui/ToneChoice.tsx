import type { Signal } from "@preact/signals";

import { TONES, type ToneKind } from "../scales/tone";
import { Choice } from "./controls";

const NAMES: Readonly<Record<ToneKind, string>> = { linear: "linear", root: "square root", logarithmic: "logarithmic" };

/** How the brightness of a picture grows with the density. */
export function ToneChoice({ tone }: { tone: Signal<ToneKind> }) {
  return (
    <Choice
      label="Tone"
      value={tone.value}
      options={TONES.map((kind) => ({ value: kind, text: NAMES[kind] }))}
      onChange={(kind) => (tone.value = kind)}
    />
  );
}
