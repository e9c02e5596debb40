import { DEGREE } from "../../physics/constants";
import { fixed, numberOf } from "../../scales/format";
import { useStore } from "../../store/store";
import { fieldOfView } from "./cloud";
import { FIELD_DEG, FIELDS_DEG, knownLens } from "./lens";

/** How wide the camera looks: as the service says, or to be set where it does not know. */
export function FieldOfView() {
  const store = useStore();
  const field_deg = store.settings.of(FIELD_DEG);
  const known = knownLens(store);
  if (known !== null) {
    return (
      <span title={`As the ${known.source} says`} data-field="field_of_view">
        <span class="quiet">field of view</span> {fixed(fieldOfView(known.width, known) / DEGREE, 1, "°")}
      </span>
    );
  }
  return (
    <label class="choice inline-row" title="How wide the camera looks, across: the service does not know">
      <span class="quiet">field of view</span>
      <input
        class="limit"
        type="text"
        inputMode="decimal"
        value={field_deg.value}
        aria-label="Horizontal field of view in degrees"
        onChange={(event) => {
          const typed_deg = numberOf(event.currentTarget.value);
          if (FIELDS_DEG.accepts(typed_deg)) field_deg.value = typed_deg;
        }}
      />
      °
    </label>
  );
}
