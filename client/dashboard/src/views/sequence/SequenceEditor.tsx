import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";

import { numberOf } from "../../scales/format";
import { RequestError } from "../../store/api";
import { useStore } from "../../store/store";
import type { AppliedDocument } from "../../stream/documents";
import type { Problem, SequenceRequest, TakeOrder, Zeroth } from "../../stream/protocol";
import { Button, Form, keptAs, NumberField, Select } from "../../ui/controls";
import { Obstacle, Steer } from "../../ui/Steer";
import { type Draft, documentOf, draftOf, missingOf, NUMBER_NAMES, NUMBERS } from "./draft";
import { Figures } from "./Figures";
import { PRESETS, presetOf } from "./presets";
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

  const ask = async (body: SequenceRequest, signal: AbortSignal): Promise<void> => {
    try {
      verdict.value = { kind: "valid", applied: await store.api.ask("POST /sequence/validate", { body, signal }) };
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
  const wrong = judged.kind === "refused" ? fieldOf(judged.problem) : null;
  const set = (change: Partial<Draft>): void => void (draft.value = { ...draft.peek(), ...change });

  return (
    <Form class="editor column grow spaced fades" onSubmit={() => void apply()}>
      <div class="fields">
        <label class="field whole-row">
          <span class="small quiet">Begin with</span>
          <Select
            name="preset"
            value=""
            of={["", ...PRESETS.map(({ name }) => name)]}
            text={(name) => (name === "" ? "the sequence in use" : `${name}: ${presetOf(name)?.words}`)}
            onChoose={(name) => (draft.value = draftOf({ ...base, ...presetOf(name)?.sequence }))}
          />
        </label>
        {NUMBER_NAMES.map((name) => (
          <NumberField
            key={name}
            name={name}
            label={name === "harmonics" ? measuredOf(base).name : FIELD_NAMES[name]}
            unit={NUMBERS[name].unit}
            text={keptAs(draft.value[name], (text) => set({ [name]: text }))}
            aria-invalid={wrong === name}
            aria-describedby="sequence-verdict"
          />
        ))}
        <label class="field whole-row">
          <span class="small quiet">Zeroth moment</span>
          <Select
            name="zeroth"
            value={draft.value.zeroth}
            of={Object.keys(ZEROTH_NAMES) as Zeroth[]}
            text={(zeroth) => `${ZEROTH_NAMES[zeroth]} (${ZEROTH_COSTS[zeroth]})`}
            aria-invalid={wrong === "zeroth"}
            onChoose={(zeroth) => set({ zeroth })}
          />
        </label>
        <label class="field whole-row">
          <span class="small quiet">Order of takes</span>
          <Select
            name="take_order"
            value={draft.value.take_order}
            of={Object.keys(TAKE_ORDER_NAMES) as TakeOrder[]}
            text={(order) => TAKE_ORDER_NAMES[order]}
            aria-invalid={wrong === "take_order"}
            disabled={numberOf(draft.value.takes) === 1}
            onChoose={(take_order) => set({ take_order })}
          />
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
      <div class="editor-actions row at-end">
        <Button onClick={onDone}>Cancel</Button>
        <Steer type="submit" class="primary" disabled={sending.value || judged.kind === "refused"}>
          {sending.value ? "Applying…" : "Apply"}
        </Steer>
      </div>
    </Form>
  );
}

function refusal(error: unknown): Verdict {
  if (error instanceof RequestError) return { kind: "refused", problem: error.problem, words: sequenceProblem(error.problem) };
  throw error;
}
