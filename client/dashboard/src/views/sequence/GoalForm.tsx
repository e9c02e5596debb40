import { useSignal } from "@preact/signals";

import { numberOf } from "../../scales/format";
import { askedRegion } from "../../store/measures";
import { useStore } from "../../store/store";
import type { PlanRequest } from "../../stream/documents";
import { Check, NumberField } from "../../ui/controls";
import "./GoalForm.css";

interface GoalFormProps {
  readonly disabled: boolean;
  readonly onGoal: (goal: PlanRequest) => void;
}

/** A target, a budget, or both: for a share of the pixels, of the region that is marked or of all. */
export function GoalForm({ disabled, onGoal }: GoalFormProps) {
  const { measures } = useStore();
  const error_mm = useSignal("");
  const share_percent = useSignal("90");
  const inRegion = useSignal(true);
  const rate_hz = useSignal("");
  const [error, rate] = [error_mm, rate_hz].map(({ value }) => (value.trim() === "" ? null : numberOf(value)));
  const wanted = [error, rate];
  const share = numberOf(share_percent.value) / 100;
  const sensible = wanted.some((value) => value !== null) && wanted.every((value) => value === null || value > 0) && share > 0 && share < 1;
  return (
    <form
      class="goal"
      onSubmit={(event) => {
        event.preventDefault();
        onGoal({
          target: error === null ? {} : { range_error_m: error * 1e-3 },
          budget: rate === null ? {} : { frame_rate_hz: rate },
          share,
          region: inRegion.value ? askedRegion(measures.region.value) : null,
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
      <NumberField
        label="in so many pixels"
        unit="%"
        name="share_percent"
        value={share_percent.value}
        onType={(text) => (share_percent.value = text)}
      />
      <NumberField label="Frames at least" unit="Hz" name="frame_rate_hz" value={rate_hz.value} onType={(text) => (rate_hz.value = text)} />
      <Check
        checked={inRegion.value && measures.region.value !== null}
        title="Of the region that is drawn in a map"
        onChange={(checked) => (inRegion.value = checked)}
      >
        {measures.region.value === null ? "no region is marked" : "in the region"}
      </Check>
      <button type="submit" disabled={disabled || !sensible}>
        Plan
      </button>
    </form>
  );
}
