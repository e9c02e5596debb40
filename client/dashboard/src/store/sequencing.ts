import { computed, type Signal, signal } from "@preact/signals";

import type { AppliedDocument, ChoiceDocument } from "../stream/documents";
import type { SequenceRequest } from "../stream/protocol";
import type { Api } from "./api";
import { type Events, sequenceKey, sequenceWords } from "./events";

/** The sequence before a change, and the estimator before it where that changed too. */
interface Before {
  /** The sequence that the change led to. */
  readonly sequence_id: number;
  readonly sequence: SequenceRequest;
  readonly estimator: string | null;
}

/** Estimators that `automatic` stands for; with one frequency all of them take its phase. */
const AUTOMATIC: readonly string[] = ["likelihood", "single-frequency"];

/** Changes of the sequence that this page makes. The last one can be undone until another follows it. */
export class Sequencing {
  readonly undoable = computed(() => this.#before.value !== null && this.#before.value.sequence_id === this.current.value?.sequence_id);
  readonly #before = signal<Before | null>(null);

  constructor(
    private readonly api: Api,
    private readonly events: Events,
    private readonly current: Signal<AppliedDocument | null>,
  ) {}

  /** Sets a sequence; raises RequestError where it is refused. */
  async set(sequence: SequenceRequest): Promise<void> {
    await this.#set(sequence, null);
  }

  /** Sets the sequence of a choice, and takes the range from what it was predicted for. */
  async apply({ sequence, estimator }: ChoiceDocument): Promise<void> {
    await this.#set(sequence, AUTOMATIC.includes(estimator) ? "automatic" : estimator);
  }

  /** Returns to what was before the change that led to a sequence; before the last change if none is named. */
  async undo(sequence_id: number | undefined = this.current.peek()?.sequence_id): Promise<void> {
    const before = this.#before.peek();
    if (before === null || before.sequence_id !== sequence_id || !this.undoable.peek()) {
      this.events.tell("The sequence was changed since: nothing was undone.", "bad");
      return;
    }
    await this.events.reported(() => this.#set(before.sequence, before.estimator));
  }

  async #set(sequence: SequenceRequest, estimator: string | null): Promise<void> {
    const before = this.current.peek();
    const applied = await this.api.ask("PUT /sequence", { body: sequence });
    this.current.value = applied;
    const { sequence_id } = applied;
    this.#before.value = before === null ? null : { sequence_id, sequence: before, estimator: null };
    const remedy = { word: "Undo", run: () => void this.undo(sequence_id) };
    this.events.tell(sequenceWords(applied), "good", { key: sequenceKey(applied), ...(before === null ? {} : { remedy }) });
    if (estimator === null) return;
    const estimatedBy = await this.#estimateBy(estimator);
    if (before !== null) this.#before.value = { sequence_id, sequence: before, estimator: estimatedBy };
  }

  /** Takes the range from an estimator; the answer is the one before, null where it is the same. */
  async #estimateBy(estimator: string): Promise<string | null> {
    const { document, tag } = await this.api.reconstruction();
    const { reconstruction_id: _, ...settings } = document;
    const before = String(settings.estimator);
    if (before === estimator) return null;
    await this.api.setReconstruction({ ...settings, estimator }, tag);
    return before;
  }
}
