import type { MapLook } from "./limits";
import { Toggle } from "../../ui/controls";

/** The ends of the scale: they follow the data until a number is typed. */
export function LimitFields({ look, unit }: { look: MapLook; unit: string }) {
  const scale = look.scale.value;
  const set = (end: "low" | "high", text: string): void => {
    const value = Number(text);
    const limits = { low: scale.low, high: scale.high, [end]: value };
    if (text !== "" && Number.isFinite(value) && limits.high > limits.low) look.manual.value = limits;
  };
  const field = (end: "low" | "high", name: string) => (
    <input
      class="limit"
      type="number"
      step="any"
      inputMode="decimal"
      aria-label={`${name} end of the scale in ${unit}`}
      value={Number(scale[end].toPrecision(6))}
      onChange={(event) => {
        set(end, event.currentTarget.value);
      }}
    />
  );
  return (
    <div class="limits">
      {field("low", "Low")}
      <span class="quiet">to</span>
      {field("high", "High")}
      <Toggle
        pressed={look.manual.value === null}
        title="Let the ends of the scale follow the data"
        onToggle={() => {
          look.manual.value = look.manual.peek() === null ? { low: scale.low, high: scale.high } : null;
        }}
      >
        auto
      </Toggle>
    </div>
  );
}
