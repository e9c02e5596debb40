import { useSignal } from "@preact/signals";

import { numberOf } from "../../scales/format";
import type { PlanRequest } from "../../stream/documents";
import "./GoalForm.css";

interface GoalFormProps {
  readonly disabled: boolean;
  readonly onGoal: (goal: PlanRequest) => void;
}

/** A target, a budget, or both. */
export function GoalForm({ disabled, onGoal }: GoalFormProps) {
  const error_mm = useSignal("");
  const rate_hz = useSignal("");
  const [error, rate] = [error_mm, rate_hz].map(({ value }) => (value.trim() === "" ? null : numberOf(value)));
  const wanted = [error, rate];
  const sensible = wanted.some((value) => value !== null) && wanted.every((value) => value === null || value > 0);
  const field = (label: string, unit: string, text: typeof error_mm, name: string) => (
    <label class="field">
      <span>{label}</span>
      <span class="field-input">
        <input
          type="text"
          inputMode="decimal"
          name={name}
          autocomplete="off"
          value={text.value}
          onInput={(event) => (text.value = event.currentTarget.value)}
        />
        <span class="quiet">{unit}</span>
      </span>
    </label>
  );
  return (
    <form
      class="goal"
      onSubmit={(event) => {
        event.preventDefault();
        onGoal({
          target: error === null ? {} : { range_error_m: error * 1e-3 },
          budget: rate === null ? {} : { frame_rate_hz: rate },
        });
      }}
    >
      {field("Error at most", "mm", error_mm, "range_error_mm")}
      {field("Frames at least", "Hz", rate_hz, "frame_rate_hz")}
      <button type="submit" disabled={disabled || !sensible}>
        Plan
      </button>
    </form>
  );
}
