import { numberOf } from "../../scales/format";
import type { SequenceDocument } from "../../stream/documents";
import type { SequenceRequest, TakeOrder, Zeroth } from "../../stream/protocol";

/** A sequence as it is typed: text, in the units people use. */
export interface Draft {
  readonly base_frequency_mhz: string;
  readonly harmonics: string;
  readonly zeroth: Zeroth;
  readonly exposure_ms: string;
  readonly takes: string;
  readonly take_order: TakeOrder;
}

/** Which field of the draft stands for a field of the document. */
export const DRAFT_FIELD: Readonly<Record<string, keyof Draft>> = {
  base_frequency_hz: "base_frequency_mhz",
  harmonics: "harmonics",
  zeroth: "zeroth",
  exposure_s: "exposure_ms",
  takes: "takes",
  take_order: "take_order",
};

export function draftOf(sequence: SequenceDocument): Draft {
  return {
    base_frequency_mhz: tidy(sequence.base_frequency_hz / 1e6),
    harmonics: String(sequence.harmonics),
    zeroth: sequence.zeroth,
    exposure_ms: tidy(sequence.exposure_s * 1e3),
    takes: String(sequence.takes),
    take_order: sequence.take_order,
  };
}

/** The field of the document of which no number is typed; null where each has one. */
export function missingOf(draft: Draft): string | null {
  const numbers = ["base_frequency_hz", "harmonics", "exposure_s", "takes"];
  return numbers.find((field) => !Number.isFinite(numberOf(draft[DRAFT_FIELD[field]]))) ?? null;
}

/** The document a draft stands for, with what is not edited from `base`; null where a field is no number. */
export function documentOf(draft: Draft, base: SequenceDocument): SequenceRequest | null {
  if (missingOf(draft) !== null) return null;
  const [frequency_mhz, harmonics, exposure_ms, takes] = [draft.base_frequency_mhz, draft.harmonics, draft.exposure_ms, draft.takes].map(
    numberOf,
  );
  return {
    base_frequency_hz: exact(frequency_mhz * 1e6),
    harmonics,
    zeroth: draft.zeroth,
    exposure_s: exact(exposure_ms / 1e3),
    takes,
    sub_phases: base.sub_phases,
    take_order: draft.take_order,
  };
}

/** A number without the tail that binary fractions leave: 1.92, not 1.9199999999999998. */
function exact(value: number): number {
  return Number(value.toPrecision(12));
}

function tidy(value: number): string {
  return String(exact(value));
}
