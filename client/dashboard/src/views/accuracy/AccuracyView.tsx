import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";

import { RequestError } from "../../store/api";
import { useStore } from "../../store/store";
import type { Choice, Tradeoff } from "../../stream/protocol";
import { engineering, fixed } from "../../ui/format";
import { useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { Steer } from "../../ui/Steer";
import { Fact } from "../sequence/Figures";
import { ZEROTH_NAMES } from "../sequence/words";
import { FrontPlot } from "./FrontPlot";
import { standingOf } from "./place";
import { goalWords } from "./words";

/** What accuracy costs in time on the scene before the camera, and the way to a better sequence. */
export function AccuracyView() {
  const store = useStore();
  useProducts(["range_error"]); // its frames say how well the camera does now
  const tradeoff = useSignal<Tradeoff | null>(null);
  const chosen = useSignal<Choice | null>(null);
  const busy = useSignal<string | null>(null);
  const refusal = useSignal<string | null>(null);
  const abort = useRef<AbortController | null>(null);
  useEffect(
    () => () => {
      abort.current?.abort();
    },
    [],
  );

  /** One question at a time: they keep the service busy for seconds. */
  const ask = async (words: string, question: (signal: AbortSignal) => Promise<void>): Promise<void> => {
    if (busy.peek() !== null) return;
    abort.current = new AbortController();
    busy.value = words;
    refusal.value = null;
    try {
      await question(abort.current.signal);
    } catch (error) {
      if (abort.current.signal.aborted) return;
      if (!(error instanceof RequestError)) throw error;
      refusal.value = goalWords(error.problem);
    } finally {
      busy.value = null;
    }
  };
  const measure = (): Promise<void> =>
    ask("Predicting what every sequence would give on this scene…", async (signal) => {
      tradeoff.value = await store.api.tradeoff(signal);
    });
  const plan = (goal: Parameters<typeof store.api.plan>[0]): Promise<void> =>
    ask("Looking for the best sequence…", async (signal) => {
      chosen.value = null; // it would seem to answer this question
      chosen.value = await store.api.plan(goal, signal);
    });
  const apply = (choice: Choice): Promise<void> =>
    ask("Applying…", async () => {
      store.sequence.value = await store.api.setSequence(choice.sequence);
    });

  return (
    <Panel
      name="accuracy"
      title={<h2>Accuracy against time</h2>}
      tools={
        <button type="button" disabled={busy.value !== null} onClick={() => void measure()}>
          {tradeoff.value === null ? "Predict" : "Predict again"}
        </button>
      }
    >
      <div class="accuracy">
        {tradeoff.value === null ? (
          <p class="accuracy-empty quiet">Predict shows what each sequence would give on the scene before the camera: it takes the service some seconds.</p>
        ) : (
          <FrontPlot tradeoff={tradeoff.value} now={standingOf(store.frames.of("range_error").value?.meta ?? null, store.sequence.value, tradeoff.value)} chosen={chosen.value} onChoose={(choice) => (chosen.value = choice)} />
        )}
        <div class="accuracy-side">
          <GoalForm disabled={busy.value !== null} onGoal={(goal) => void plan(goal)} />
          <p class={refusal.value === null ? "quiet" : "refusal"} role="status" data-field="accuracy-status">
            {busy.value ?? refusal.value ?? ""}
          </p>
          {chosen.value !== null && <ChoiceFacts choice={chosen.value} disabled={busy.value !== null} onApply={(choice) => void apply(choice)} />}
        </div>
      </div>
    </Panel>
  );
}

interface GoalFormProps {
  readonly disabled: boolean;
  readonly onGoal: (goal: { target: { range_error_m?: number }; budget: { frame_rate_hz?: number } }) => void;
}

/** A target, a budget, or both. */
function GoalForm({ disabled, onGoal }: GoalFormProps) {
  const error_mm = useSignal("");
  const rate_hz = useSignal("");
  const wanted = [error_mm, rate_hz].map(({ value }) => (value.trim() === "" ? null : Number(value)));
  const sensible = wanted.some((value) => value !== null) && wanted.every((value) => value === null || value > 0);
  const field = (label: string, unit: string, text: typeof error_mm, name: string) => (
    <label class="field">
      <span>{label}</span>
      <span class="field-input">
        <input type="text" inputMode="decimal" name={name} autocomplete="off" value={text.value} onInput={(event) => (text.value = event.currentTarget.value)} />
        <span class="quiet">{unit}</span>
      </span>
    </label>
  );
  return (
    <form
      class="goal"
      onSubmit={(event) => {
        event.preventDefault();
        const [error, rate] = wanted;
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

function ChoiceFacts({ choice, disabled, onApply }: { choice: Choice; disabled: boolean; onApply: (choice: Choice) => void }) {
  const { sequence, predicted } = choice;
  const { median, low, high } = predicted.range_error_m;
  return (
    <div class="choice-facts" data-field="choice">
      <dl class="facts">
        <Fact name="Error of the range" value={`${engineering(median, "m")} (${engineering(low, "m")} to ${engineering(high, "m")})`} field="choice_range_error_m" />
        <Fact name="of that noise" value={engineering(predicted.range_std_m.median, "m")} field="choice_range_std_m" />
        <Fact name="of that bias" value={engineering(predicted.range_bias_m, "m")} field="choice_range_bias_m" />
        <Fact name="Outliers" value={fixed(100 * predicted.outlier_share, 1, "%")} field="choice_outlier_share" />
        <Fact name="Capture time" value={engineering(choice.capture_s, "s")} field="choice_capture_s" />
        <Fact name="Frame rate" value={fixed(choice.frame_rate_hz, 1, "Hz")} field="choice_frame_rate_hz" />
        <Fact name="Harmonics m" value={String(sequence.harmonics)} field="choice_harmonics" />
        <Fact name="Exposure" value={engineering(sequence.exposure_s, "s")} field="choice_exposure_s" />
        <Fact name="Takes" value={String(sequence.takes)} field="choice_takes" />
        <Fact name="Zeroth moment" value={ZEROTH_NAMES[sequence.zeroth]} field="choice_zeroth" />
      </dl>
      <Steer
        primary
        disabled={disabled}
        onClick={() => {
          onApply(choice);
        }}
      >
        Apply this sequence
      </Steer>
    </div>
  );
}
