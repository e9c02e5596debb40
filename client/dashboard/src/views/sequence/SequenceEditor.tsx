import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";

import { numberOf } from "../../scales/format";
import { RequestError } from "../../store/api";
import { useStore } from "../../store/store";
import type { AppliedDocument } from "../../stream/documents";
import type { Problem, SequenceRequest, TakeOrder, Zeroth } from "../../stream/protocol";
import { NumberField } from "../../ui/controls";
import { Obstacle, Steer } from "../../ui/Steer";
import { DRAFT_FIELD, type Draft, documentOf, draftOf, missingOf } from "./draft";
import { Figures } from "./Figures";
import { PRESETS } from "./presets";
import { FIELD_NAMES, fieldOf, measuredOf, sequenceProblem, TAKE_ORDER_NAMES, ZEROTH_COSTS, ZEROTH_NAMES } from "./words";
import "./SequenceEditor.css";

/** Pause after the last keystroke before the service is asked what the sequence would cost. */
const TYPING_PAUSE_MS = 250;

/** What came of asking the service about a draft. */
type Verdict =
  | { readonly kind: "asking" }
  | { readonly kind: "valid"; readonly applied: AppliedDocument }
  | { readonly kind: "refused"; readonly problem: Problem; readonly words: string };

/** A form that shows, as you type, what a sequence would cost, and says in plain words what is wrong with it. */
export function SequenceEditor({ applied, onDone }: { applied: AppliedDocument; onDone: () => void }) {
  const store = useStore();
  // The sequence that editing began with: one that changes meanwhile must not overwrite what is typed.
  const base = useMemo(() => applied, []);
  const draft = useSignal<Draft>(draftOf(base));
  const verdict = useSignal<Verdict>({ kind: "valid", applied: base });
  const sending = useSignal(false);
  const document = documentOf(draft.value, base);

  useEffect(() => {
    if (document === null) {
      const field = missingOf(draft.peek()) ?? "";
      verdict.value = refusal(new RequestError({ field, detail: `${FIELD_NAMES[field]} needs a number.` }));
      return undefined;
    }
    const abort = new AbortController();
    const timer = setTimeout(() => void ask(document, abort.signal), TYPING_PAUSE_MS);
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  }, [JSON.stringify(document), missingOf(draft.value)]);

  const ask = async (asked: SequenceRequest, signal: AbortSignal): Promise<void> => {
    try {
      verdict.value = { kind: "valid", applied: await store.api.validate(asked, signal) };
    } catch (error) {
      if (!signal.aborted) verdict.value = refusal(error);
    }
  };

  const apply = async (): Promise<void> => {
    if (document === null) return;
    sending.value = true;
    try {
      await store.sequencing.set(document);
      onDone();
    } catch (error) {
      verdict.value = refusal(error);
    } finally {
      sending.value = false;
    }
  };

  const judged = verdict.value;
  const wrong = judged.kind === "refused" ? (DRAFT_FIELD[fieldOf(judged.problem) ?? ""] ?? null) : null;
  const field = (name: keyof Draft, label: string, unit: string) => (
    <NumberField
      label={label}
      unit={unit}
      name={name}
      value={draft.value[name] ?? ""}
      aria-invalid={wrong === name}
      aria-describedby="sequence-verdict"
      onType={(text) => (draft.value = { ...draft.peek(), [name]: text })}
    />
  );

  return (
    <form
      class="editor fades"
      onSubmit={(event) => {
        event.preventDefault();
        void apply();
      }}
    >
      <div class="fields">
        <label class="field field-wide">
          <span>Begin with</span>
          <select
            name="preset"
            value=""
            onChange={(event) => {
              const preset = PRESETS.find(({ name }) => name === event.currentTarget.value);
              if (preset !== undefined) draft.value = draftOf({ ...base, ...preset.sequence });
            }}
          >
            <option value="">the sequence in use</option>
            {PRESETS.map(({ name, words }) => (
              <option key={name} value={name}>
                {name}: {words}
              </option>
            ))}
          </select>
        </label>
        {field("base_frequency_mhz", "Base frequency", "MHz")}
        {field("harmonics", measuredOf(base).name, "")}
        {field("exposure_ms", "Exposure", "ms")}
        {field("takes", "Takes", "")}
        <label class="field field-wide">
          <span>Zeroth moment</span>
          <select
            name="zeroth"
            value={draft.value.zeroth}
            aria-invalid={wrong === "zeroth"}
            onChange={(event) => (draft.value = { ...draft.peek(), zeroth: event.currentTarget.value as Zeroth })}
          >
            {(Object.keys(ZEROTH_NAMES) as Zeroth[]).map((zeroth) => (
              <option key={zeroth} value={zeroth}>
                {ZEROTH_NAMES[zeroth]} ({ZEROTH_COSTS[zeroth]})
              </option>
            ))}
          </select>
        </label>
        <label class="field field-wide">
          <span>Order of takes</span>
          <select
            name="take_order"
            value={draft.value.take_order}
            aria-invalid={wrong === "take_order"}
            disabled={numberOf(draft.value.takes) === 1}
            onChange={(event) => (draft.value = { ...draft.peek(), take_order: event.currentTarget.value as TakeOrder })}
          >
            {Object.entries(TAKE_ORDER_NAMES).map(([order, name]) => (
              <option key={order} value={order}>
                {name}
              </option>
            ))}
          </select>
        </label>
      </div>
      <Obstacle />
      <div id="sequence-verdict" class="verdict" role="status">
        {judged.kind === "refused" && <p class="refusal">{judged.words}</p>}
        {judged.kind === "valid" && (
          <dl class="facts">
            <Figures applied={judged.applied} />
          </dl>
        )}
      </div>
      <div class="editor-actions">
        <button type="button" onClick={onDone}>
          Cancel
        </button>
        <Steer submit primary disabled={sending.value || judged.kind === "refused"}>
          {sending.value ? "Applying…" : "Apply"}
        </Steer>
      </div>
    </form>
  );
}

function refusal(error: unknown): Verdict {
  if (error instanceof RequestError) return { kind: "refused", problem: error.problem, words: sequenceProblem(error.problem) };
  throw error;
}
