import type { Signal } from "@preact/signals";

import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import { Choice } from "./controls";

/** Which colours a picture has, by the names of the colour maps. */
export function ColourChoice({ colours }: { colours: Signal<ColourMapName> }) {
  return (
    <Choice
      label="Colours"
      value={colours.value}
      options={COLOUR_MAPS.map((name) => ({ value: name, text: name }))}
      onChange={(name) => (colours.value = name)}
    />
  );
}
