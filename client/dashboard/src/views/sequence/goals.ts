import { engineering, fixed } from "../../scales/format";
import { plainWords } from "../../store/api";
import type { Problem } from "../../stream/protocol";

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
