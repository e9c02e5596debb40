import { ColourChoice } from "../../ui/ColourChoice";
import { Choice } from "../../ui/controls";
import { PopoverButton } from "../../ui/PopoverButton";
import { ToneChoice } from "../../ui/ToneChoice";
import type { TransientLook } from "./look";

const STOPS = [-4, -3, -2, -1, 0, 1, 2, 3, 4, 6, 8];

/** How the light is shown, behind a button. */
export function LookMenu({ look }: { look: TransientLook }) {
  return (
    <PopoverButton face="Look" label="Look of the light" title="Tone, exposure and colours" kind="look">
      <ToneChoice tone={look.tone} />
      <Choice label="Exposure" value={look.stops.value} options={STOPS.map((stops) => ({ value: stops, text: stopsText(stops) }))} onChange={(stops) => (look.stops.value = stops)} />
      <ColourChoice colours={look.colours} />
      {look.play.value === "density" && (
        <label class="check" title="Show the still scene behind the light">
          <input type="checkbox" checked={look.backdrop.value} onChange={(event) => (look.backdrop.value = event.currentTarget.checked)} />
          Scene behind the light
        </label>
      )}
    </PopoverButton>
  );
}

/** Exposure as photographers count it: a stop is a factor of two. */
function stopsText(stops: number): string {
  const count = Math.abs(stops);
  return stops === 0 ? "as metered" : `${count} ${count === 1 ? "stop" : "stops"} ${stops > 0 ? "brighter" : "darker"}`;
}
