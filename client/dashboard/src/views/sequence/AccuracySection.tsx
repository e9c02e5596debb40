import { engineering, fixed, numberOf } from "../../scales/format";
import { useStore } from "../../store/store";
import type { AppliedDocument, ChoiceDocument, PlanRequest } from "../../stream/documents";
import { Button, Check, Choice, Form, NumberField } from "../../ui/controls";
import { useProducts } from "../../ui/hooks";
import { Obstacle, Steer } from "../../ui/Steer";
import { type Task, useTask } from "../../ui/useTask";
import { ChoiceFacts, Summary } from "./Figures";
import { FrontPlot } from "./FrontPlot";
import { PlannedMap, PriceBar } from "./PriceBar";
import { sameSequence, standingOf, stepOf } from "./place";
import { errorWords, goalWords } from "./words";
import "./AccuracySection.css";
import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { askedRegion } from "../../store/measures";

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
  const others = accuracy.others.value;
  const busy = accuracy.job.value !== null || task.busy.value !== null;
  const look = (choice: ChoiceDocument): void => void (accuracy.looked.value = choice);
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
        {others.length > 0 && (
          <Choice
            label="Planned with"
            chosen={accuracy.estimator}
            of={["", ...others.map(({ name }) => name)]}
            text={(chosen) => others.find(({ name }) => name === chosen)?.label ?? "the best of our estimators"}
          />
        )}
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

const HINT = "Predict shows what each sequence would give on this scene: some seconds of work for the service.";

/** How far the service is with what was asked, and the way to end it; else what came of it, or of setting a sequence. Its height stays. */
function Finding({ task }: { task: Task }) {
  const { accuracy } = useStore();
  const job = accuracy.job.value;
  const problem = accuracy.problem.value;
  if (job !== null) {
    const share = `${Math.round(100 * job.progress)}\u202f%`;
    return (
      <div class="finding row" role="status" data-field="accuracy-status">
        <progress value={job.progress} aria-label={job.kind === "tradeoff" ? "Prediction" : "Plan"} />
        <span class="finding-words">
          {share} <span class="quiet">{job.step}</span>
        </span>
        <Button onClick={() => void accuracy.cancel()}>Cancel</Button>
      </div>
    );
  }
  const refusal = task.refusal.value ?? (problem === null ? null : goalWords(problem));
  const found = accuracy.outdated.value ? "The scene changed since: predict again." : (accuracy.tradeoff.value?.summary ?? HINT);
  return (
    <p class={`finding row ${refusal === null ? "quiet" : "refusal"}`} role="status" data-field="accuracy-status">
      {task.busy.value ?? refusal ?? found}
    </p>
  );
}

/** A target, a budget, or both: for a share of the pixels, of the region that is marked or of all. */
function GoalForm({ disabled, onGoal }: { disabled: boolean; onGoal: (goal: PlanRequest) => void }) {
  const { measures, camera } = useStore();
  const real = camera.value?.simulated === false;
  const look = useSignal(true);
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
          ...(real && { look: look.value }),
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
      {real && (
        <Check
          checked={look.value}
          title="At all frequencies; else by the current frame alone"
          onChange={(checked) => (look.value = checked)}
        >
          look first, some seconds without frames
        </Check>
      )}
      <Button type="submit" disabled={disabled || !sensible}>
        Plan
      </Button>
    </Form>
  );
}

interface FrontSliderProps {
  /** By rising time and falling error. */
  readonly front: readonly ChoiceDocument[];
  /** Time of a capture with the sequence in use. */
  readonly now_s: number;
  readonly looked: ChoiceDocument | null;
  readonly onLook: (choice: ChoiceDocument) => void;
  /** The slider was let go at what is looked at. */
  readonly onRelease: () => void;
}

/** Keys that move a slider; the page's own shortcuts are not meant then. */
const MOVING: readonly string[] = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];

/** From fast to accurate along the front, a step a point; where the camera stands now is marked on it. */
function FrontSlider({ front, now_s, looked, onLook, onRelease }: FrontSliderProps) {
  const moved = useRef(false);
  const key = useRef(false);
  const release = (): void => {
    key.current = false;
    if (!moved.current) return;
    moved.current = false;
    onRelease();
  };
  const last = front.length - 1;
  const ghost = last < 1 ? null : stepOf(front, now_s);
  const at = front.findIndex((choice) => sameSequence(choice, looked));
  const step = at >= 0 ? at : looked !== null && last > 0 ? Math.round(stepOf(front, looked.capture_s)) : Math.round(ghost ?? 0);
  return (
    <div class="row quiet">
      <span aria-hidden="true">fast</span>
      <div class="front-track grow">
        {ghost !== null && <i class="front-ghost" data-field="ghost" style={{ "--place": ghost / last }} title="The present setting" />}
        <input
          type="range"
          min={0}
          max={Math.max(1, last)}
          step={1}
          value={step}
          disabled={last < 1}
          aria-label="From fast to accurate"
          aria-valuetext={last < 1 ? "Not predicted yet" : choiceWords(at < 0 && looked !== null ? looked : front[step])}
          onInput={(event) => {
            moved.current = true;
            onLook(front[event.currentTarget.valueAsNumber]);
          }}
          onChange={() => {
            if (!key.current) release();
          }}
          onKeyDown={(event) => {
            if (!MOVING.includes(event.key)) return;
            event.stopPropagation();
            key.current = true;
          }}
          onKeyUp={release}
          onBlur={release}
        />
      </div>
      <span aria-hidden="true">accurate</span>
    </div>
  );
}

/** What a choice gives and takes: "± 4.0 mm in 94 ms, 10.6 Hz". */
function choiceWords(choice: ChoiceDocument): string {
  return `± ${engineering(choice.predicted.range_error_m.median, "m", 2)} in ${engineering(choice.capture_s, "s", 2)}, ${fixed(choice.frame_rate_hz, 1, "Hz")}`;
}
