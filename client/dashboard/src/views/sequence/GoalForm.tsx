import { useSignal } from "@preact/signals";

import { numberOf } from "../../scales/format";
import type { PlanRequest } from "../../stream/documents";
import { NumberField } from "../../ui/controls";
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
      <NumberField
        label="Error at most"
        unit="mm"
        name="range_error_mm"
        value={error_mm.value}
        onType={(text) => (error_mm.value = text)}
      />
      <NumberField label="Frames at least" unit="Hz" name="frame_rate_hz" value={rate_hz.value} onType={(text) => (rate_hz.value = text)} />
      <button type="submit" disabled={disabled || !sensible}>
        Plan
      </button>
    </form>
  );
}
