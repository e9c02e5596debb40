import { useSignal } from "@preact/signals";
import { numberOf } from "../scales/format";
import type { Span } from "../scales/scale";
import type { Look, Looks } from "../store/looks";
import { Check } from "./controls";
import "./LimitFields.css";

/** Limits with one end typed anew, or why they make no sense. */
export function typed({ low, high }: Span, end: keyof Span, text: string): Span | string {
  const value = numberOf(text);
  if (!Number.isFinite(value)) return `${text.trim() === "" ? "Nothing" : `“${text}”`} is no number.`;
  const limits = { low, high, [end]: value };
  return limits.high > limits.low ? limits : `The low end must lie below the high end: ${limits.low} does not lie below ${limits.high}.`;
}

/** The ends of the scale: they follow the data until a number is typed. */
export function LimitFields({ look, looks }: { look: Look; looks: Looks }) {
  const scale = look.scale.value;
  const wrong = useSignal<{ readonly end: keyof Span; readonly words: string } | null>(null);
  const set = (end: keyof Span, text: string): void => {
    const limits = typed(scale, end, text);
    wrong.value = typeof limits === "string" ? { end, words: limits } : null;
    if (typeof limits !== "string") looks.limit(look, limits);
  };
  const field = (end: keyof Span, name: string) => (
    <input
      class="limit"
      type="text"
      inputMode="decimal"
      aria-label={`${name} end of the scale in ${look.product.unit}`}
      aria-invalid={wrong.value?.end === end}
      value={Number(scale[end].toPrecision(4))}
      onChange={(event) => set(end, event.currentTarget.value)}
    />
  );
  const { unit } = look.product;
  return (
    <>
      <p class="limits row apart">
        <span class="quiet">Limits</span>
        <span>
          {field("low", "Low")} <span class="quiet">to</span> {field("high", "High")} {unit === "1" ? "" : unit}
        </span>
      </p>
      {wrong.value !== null && (
        <p class="refusal" role="alert" data-field="limits-refusal">
          {wrong.value.words}
        </p>
      )}
      <Check
        checked={look.manual.value === null}
        onChange={(follows) => {
          wrong.value = null;
          looks.limit(look, follows ? null : { low: scale.low, high: scale.high });
        }}
      >
        Limits follow the data
      </Check>
      <Check checked={looks.locked.value} onChange={(locked) => looks.lock(look, locked)}>
        The same limits for all maps{unit === "1" ? " without a unit" : ` in ${unit}`}
      </Check>
    </>
  );
}
