import type { TransientLook } from "../../store/lightLook";
import { Check, Choice } from "../../ui/controls";
import { ColourChoice, ToneChoice } from "../../ui/LookChoices";
import { PopoverButton } from "../../ui/PopoverButton";

const STOPS = [-4, -3, -2, -1, 0, 1, 2, 3, 4, 6, 8];

/** How the light is shown, behind a button. */
export function LookMenu({ look }: { look: TransientLook }) {
  return (
    <PopoverButton face="Look" label="Look of the light" title="Tone, exposure and colours" kind="look">
      <ToneChoice tone={look.tone} />
      <Choice label="Exposure" chosen={look.stops} of={STOPS} text={stopsText} />
      <ColourChoice colours={look.colours} />
      {look.play.value === "density" && (
        <Check
          title="Show the still scene behind the light"
          checked={look.backdrop.value}
          onChange={(shown) => (look.backdrop.value = shown)}
        >
          Scene behind the light
        </Check>
      )}
    </PopoverButton>
  );
}

/** Exposure as photographers count it: a stop is a factor of two. */
function stopsText(stops: number): string {
  const count = Math.abs(stops);
  return stops === 0 ? "as metered" : `${count} ${count === 1 ? "stop" : "stops"} ${stops > 0 ? "brighter" : "darker"}`;
}
