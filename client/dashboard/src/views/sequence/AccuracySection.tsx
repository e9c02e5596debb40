import { engineering, fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { AppliedDocument, ChoiceDocument } from "../../stream/documents";
import { Button } from "../../ui/controls";
import { useProducts } from "../../ui/hooks";
import { Obstacle, Steer } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { ChoiceFacts, Summary } from "./Figures";
import { Finding } from "./Finding";
import { FrontPlot } from "./FrontPlot";
import { FrontSlider } from "./FrontSlider";
import { GoalForm } from "./GoalForm";
import { PlannedMap, PriceBar } from "./PriceBar";
import { sameSequence, standingOf } from "./place";
import { errorWords } from "./words";
import "./AccuracySection.css";

/** What accuracy costs in time on the scene before the camera: the front, and a slider along it that sets the sequence. */
export function AccuracySection({ applied }: { applied: AppliedDocument }) {
  const store = useStore();
  const { accuracy, sequencing, obstacle } = store;
  const task = useTask();
  const tradeoff = accuracy.tradeoff.value;
  // Its frames say how well the camera does now. It costs the service something: not before it is compared with.
  useProducts(tradeoff === null ? [] : ["range_error"]);
  const now = tradeoff === null ? null : standingOf(store.frames.of("range_error").value?.meta ?? null, applied, tradeoff);
  // Of a simulated scene: how far the frame was off that the front was predicted beside.
  const judged = tradeoff !== null && tradeoff.current.meta.sequence_id === applied.sequence_id && !accuracy.outdated.value;
  const truth_m = judged ? (tradeoff.current.range_error_m?.median ?? null) : null;
  const looked = accuracy.looked.value;
  const busy = accuracy.job.value !== null || task.busy.value !== null;
  const look = (choice: ChoiceDocument): void => {
    accuracy.looked.value = choice;
  };
  const apply = async (): Promise<void> => {
    const choice = accuracy.looked.peek();
    if (choice === null || obstacle.peek() !== null) return;
    if (await task.run("Applying…", () => sequencing.apply(choice))) {
      if (sameSequence(accuracy.looked.peek(), choice)) accuracy.looked.value = null;
    }
  };
  return (
    <div class="accuracy fades" data-predicted={tradeoff !== null}>
      {tradeoff !== null && <FrontPlot tradeoff={tradeoff} now={now} chosen={looked} onChoose={look} />}
      <div class="accuracy-control column spaced">
        <p class="accuracy-figures line">
          {looked === null ? <NowFigures applied={applied} truth_m={truth_m} /> : <LookedFigures choice={looked} />}
        </p>
        <FrontSlider front={tradeoff?.front ?? []} now_s={applied.capture_s} looked={looked} onLook={look} onRelease={() => void apply()} />
        <Finding task={task} />
        {tradeoff !== null && <Obstacle />}
        {looked !== null && (
          <div class="row at-end">
            <Button onClick={() => (accuracy.looked.value = null)}>Back to the present</Button>
            <Steer class="primary" disabled={busy} onClick={() => void apply()}>
              Apply
            </Steer>
          </div>
        )}
      </div>
      <div class="accuracy-facts column spaced fades">
        {looked === null ? <Summary applied={applied} /> : <ChoiceFacts choice={looked} />}
        {looked !== null && <PriceBar choice={looked} />}
        <PlannedMap />
        <details class="accuracy-goal">
          <summary>Plan for a target</summary>
          <GoalForm disabled={busy} onGoal={(goal) => void accuracy.plan(goal)} />
        </details>
      </div>
    </div>
  );
}

function LookedFigures({ choice }: { choice: ChoiceDocument }) {
  return (
    <>
      <strong data-field="choice_range_error_m">± {engineering(choice.predicted.range_error_m.median, "m")}</strong>{" "}
      <span data-field="choice_capture_s">{engineering(choice.capture_s, "s")}</span>
      <span data-field="choice_frame_rate_hz">{fixed(choice.frame_rate_hz, 1, "Hz")}</span> <span class="quiet">predicted</span>
    </>
  );
}

/** How well the camera does now, by the figure of the header; and where the truth is known how far it is off. */
function NowFigures({ applied, truth_m }: { applied: AppliedDocument; truth_m: number | null }) {
  const { status, rangeErrors } = useStore();
  const error = status.newest.value?.sequence_id === applied.sequence_id ? rangeErrors.now.value : null;
  return (
    <>
      <strong
        data-field="now_range_error_m"
        title={`Of the range in the median pixel: ${error?.of === "interval" ? "1 σ of noise and bias together" : errorWords(error)}`}
      >
        ± {engineering(error?.planned_m, "m", 2)}
      </strong>{" "}
      {error?.of === "noise" && <span class="quiet">noise</span>} <span>{engineering(applied.capture_s, "s")}</span>{" "}
      <span>{fixed(applied.frame_rate_hz, 1, "Hz")}</span>{" "}
      <span class="quiet">
        now
        {truth_m !== null && `, ${engineering(truth_m, "m", 2)} off the truth`}
      </span>
    </>
  );
}
