import { numberOf } from "../../scales/format";
import type { SequenceDocument } from "../../stream/documents";
import type { SequenceRequest } from "../../stream/protocol";

/** The fields of a sequence that are typed as numbers: in which unit, and how much of the document's own that is. */
export const NUMBERS = {
  base_frequency_hz: { unit: "MHz", size: 1e6 },
  harmonics: { unit: "", size: 1 },
  exposure_s: { unit: "ms", size: 1e-3 },
  takes: { unit: "", size: 1 },
} as const;

export type NumberName = keyof typeof NUMBERS;

export const NUMBER_NAMES = Object.keys(NUMBERS) as readonly NumberName[];

/** A sequence as it is typed: numbers as text, in the units people use. */
export type Draft = Readonly<Record<NumberName, string>> & Pick<SequenceDocument, "zeroth" | "take_order">;

export function draftOf(sequence: SequenceDocument): Draft {
  const { zeroth, take_order } = sequence;
  const numbers = NUMBER_NAMES.map((name) => [name, String(exact(sequence[name] / NUMBERS[name].size))]);
  return { ...(Object.fromEntries(numbers) as Record<NumberName, string>), zeroth, take_order };
}

/** The field of which no number is typed; null where each has one. */
export function missingOf(draft: Draft): NumberName | null {
  return NUMBER_NAMES.find((name) => !Number.isFinite(numberOf(draft[name]))) ?? null;
}

/** The document a draft stands for, with what is not edited from `base`; null where a field is no number. */
export function documentOf(draft: Draft, { sub_phases }: SequenceDocument): SequenceRequest | null {
  if (missingOf(draft) !== null) return null;
  const { zeroth, take_order } = draft;
  const numbers = NUMBER_NAMES.map((name) => [name, exact(numberOf(draft[name]) * NUMBERS[name].size)]);
  return { ...(Object.fromEntries(numbers) as Record<NumberName, number>), zeroth, sub_phases, take_order };
}

/** A number without the tail that binary fractions leave: 1.92, not 1.9199999999999998. */
function exact(value: number): number {
  return Number(value.toPrecision(12));
}
