import { useStore } from "../store/store";
import "./LightOffButton.css";

/**
 * Switches the light off, whichever client controls the camera.
 *
 * It stands at the same place of the window in the page and in each dialog, as what is beside an open dialog takes no clicks.
 */
export function LightOffButton() {
  const { lightOff } = useStore();
  return (
    <button type="button" class="light-off" title="Switch the camera's light off, whoever controls it (X)" onClick={() => lightOff.press()}>
      Light off
    </button>
  );
}
