import type { Signal } from "@preact/signals";

import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import { TONES, type ToneKind } from "../scales/tone";
import { Choice } from "./controls";

/** Which colours a picture has, by the names of the colour maps. */
export function ColourChoice({ colours }: { colours: Signal<ColourMapName> }) {
  return <Choice label="Colours" chosen={colours} of={COLOUR_MAPS} text={String} />;
}

const TONE_NAMES: Readonly<Record<ToneKind, string>> = { linear: "linear", root: "square root", logarithmic: "logarithmic" };

/** How the brightness of a picture grows with the density. */
export function ToneChoice({ tone }: { tone: Signal<ToneKind> }) {
  return <Choice label="Tone" chosen={tone} of={TONES} text={(kind) => TONE_NAMES[kind]} />;
}
