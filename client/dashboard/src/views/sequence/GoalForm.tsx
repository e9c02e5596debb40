import { useSignal } from "@preact/signals";

import { numberOf } from "../../scales/format";
import { askedRegion } from "../../store/measures";
import { useStore } from "../../store/store";
import type { PlanRequest } from "../../stream/documents";
import { Button, Check, Form, NumberField } from "../../ui/controls";
import "./GoalForm.css";

/** A target, a budget, or both: for a share of the pixels, of the region that is marked or of all. */
export function GoalForm({ disabled, onGoal }: { disabled: boolean; onGoal: (goal: PlanRequest) => void }) {
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
    <Form
      class="goal"
      onSubmit={() =>
        onGoal({
          target: error === null ? {} : { range_error_m: error * 1e-3 },
          budget: rate === null ? {} : { frame_rate_hz: rate },
          share,
          region: inRegion.value ? askedRegion(measures.region.value) : null,
        })
      }
    >
      <NumberField label="Error at most" unit="mm" name="range_error_mm" text={error_mm} />
      <NumberField label="in so many pixels" unit="%" name="share_percent" text={share_percent} />
      <NumberField label="Frames at least" unit="Hz" name="frame_rate_hz" text={rate_hz} />
      <Check
        checked={inRegion.value && measures.region.value !== null}
        title="Of the region that is drawn in a map"
        onChange={(checked) => (inRegion.value = checked)}
      >
        {measures.region.value === null ? "no region is marked" : "in the region"}
      </Check>
      <Button type="submit" disabled={disabled || !sensible}>
        Plan
      </Button>
    </Form>
  );
}
