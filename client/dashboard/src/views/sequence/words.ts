import { deviation, engineering, fixed } from "../../scales/format";
import { plainWords } from "../../store/api";
import type { RangeErrorFigure } from "../../store/rangeErrors";
import type { SequenceDocument } from "../../stream/documents";
import type { Problem, TakeOrder, Zeroth } from "../../stream/protocol";
import { notJudgedWords } from "../../ui/flags";

/** Names of the fields as the form has them. */
export const FIELD_NAMES: Readonly<Record<string, string>> = {
  base_frequency_hz: "Base frequency",
  harmonics: "Harmonics m",
  zeroth: "Zeroth moment",
  exposure_s: "Exposure",
  takes: "Takes",
  take_order: "Order of takes",
};

/** What is measured of the base frequency: its multiples 1 to m, or others that a camera has of its own. */
export function measuredOf({ harmonics, sampling }: Pick<SequenceDocument, "harmonics" | "sampling">): {
  readonly name: string;
  readonly value: string;
} {
  const multiples = sampling?.multiples ?? [];
  return multiples.length === 0 ? { name: "Harmonics m", value: String(harmonics) } : { name: "Multiples", value: multiples.join(", ") };
}

/** The name of the field that a problem is about, as "harmonics" or as "body.harmonics". */
export function fieldOf(problem: Problem): string | null {
  return problem.field?.split(".").pop() ?? null;
}

/** What is wrong with a sequence, in the words and units of the form. */
export function sequenceProblem(problem: Problem): string {
  const name = FIELD_NAMES[fieldOf(problem) ?? ""];
  if (name === undefined || typeof problem.limit !== "string") return plainWords(problem);
  return `${name} must be ${inUnits(problem.limit)}.`;
}

/** Quantities as people write them: "from 2e-05 to 0.05 s" becomes "from 20 µs to 50 ms". */
function inUnits(limit: string): string {
  return limit.replace(QUANTITY, (_, first: string, joined: string | undefined, second: string | undefined, unit: string) =>
    [quantity(first, unit), ...(joined && second ? [joined, quantity(second, unit)] : [])].join(""),
  );
}

/** One number with its unit, or two that share it. */
const QUANTITY = /([\d.]+(?:e[+-]?\d+)?)(?:( to )([\d.]+(?:e[+-]?\d+)?))? (Hz|s)\b/g;

function quantity(text: string, unit: string): string {
  const digits = text.replace(/e.*|[.]/g, "").replace(/^0+|0+$/g, "").length;
  return engineering(Number(text), unit, Math.max(2, digits));
}

/** How the zeroth moment is had (Sec. 4.3), in words. */
export const ZEROTH_NAMES: Record<Zeroth, string> = {
  "low-frequency": "low frequency",
  "on-off": "light on − off",
  estimated: "estimated",
};

export const ZEROTH_COSTS: Record<Zeroth, string> = {
  "low-frequency": "four images more a take",
  "on-off": "two images more a take",
  estimated: "no images more",
};

/** How takes follow each other, in words. */
export const TAKE_ORDER_NAMES: Readonly<Record<TakeOrder, string>> = { sequential: "one after another", interleaved: "image by image" };

/** What an error of the range holds. */
export function errorWords(error: RangeErrorFigure | null): string {
  if (error === null) return "not known yet";
  return error.of === "noise" ? "noise alone (1 σ), as its bias is not known" : "half of the 90 % interval, of noise and bias together";
}

/** What the ranges of a picture are worth: as shares of it where these are known. */
export function shareWords(error: RangeErrorFigure | null): { readonly short: string; readonly long: string } {
  const within = deviation(error?.within_m, "m") || "trusted";
  if (error?.trusted_share == null) {
    const short = `${deviation(error?.error_m, "m")}${error?.of === "noise" ? " noise" : ""}`;
    return { short, long: `the error of the range in the median pixel is ${errorWords(error)}` };
  }
  const [trusted, rest] = [error.trusted_share, 1 - error.trusted_share].map((share) => fixed(100 * share, 0, "%"));
  const unjudged = notJudgedWords(error.not_judged);
  const most = unjudged === "" ? "" : "≤\u202f";
  return {
    short: `${most}${trusted} ${within}`,
    long: [`${most}${trusted} of the picture ${within} (90 % intervals), ${rest} not trusted`, unjudged].filter(Boolean).join("; "),
  };
}

/** Goals as the service names them, as the form does, with their values. */
const GOALS: readonly (readonly [field: string, name: string, write: (value: number) => string])[] = [
  ["frame_rate_hz", "frame rate", (value) => fixed(value, 1, "Hz")],
  ["range_error_m", "error of the range", (value) => engineering(value, "m")],
  ["range_std_m", "deviation of the range", (value) => engineering(value, "m")],
  ["capture_s", "capture time", (value) => engineering(value, "s")],
];

/** Why a goal was refused, in the names and units of the form. */
export function goalWords(problem: Problem): string {
  let words = plainWords(problem);
  for (const [field, name, write] of GOALS) {
    const figure = new RegExp(`${field} (=|is) ([\\d.]+(?:e[+-]?\\d+)?\\d|\\d)`, "g");
    words = words.replace(figure, (_, joined: string, value: string) => `${name} ${joined === "=" ? "of" : "is"} ${write(Number(value))}`);
    words = words.replaceAll(field, name);
  }
  return [words, ...takesWords(problem)].join(" ");
}

/** What takes give where the camera leaves nothing else to choose. */
function takesWords({ takes = [] }: Problem): string[] {
  return takes.map(
    (each) =>
      `${each.takes} ${each.takes === 1 ? "take" : "takes"}: ${engineering(each.capture_s, "s")}, range to ${engineering(each.range_std_m, "m")}.`,
  );
}
