import { fixed } from "../../scales/format";
import type { CalibrationDocument, VerdictDocument } from "../../stream/documents";

/** How old something is, as people say it. */
export function ageOf(age_s: number): string {
  if (age_s < 90) return "just now";
  if (age_s < 5400) return `${Math.round(age_s / 60)} min ago`;
  if (age_s < 172_800) return `${Math.round(age_s / 3600)} h ago`;
  return `${Math.round(age_s / 86_400)} days ago`;
}

/** What is said of a calibration that was not measured on a diffuser; null where it was. */
export function doubtOf({ verdict }: VerdictDocument): { tag: string; words: string } | null {
  if (verdict === "diffusor") return null;
  return verdict === "scene"
    ? { tag: "of a scene", words: "It was measured on a scene, not on a diffuser." }
    : { tag: "in doubt", words: "It may not have been measured on a diffuser." };
}

/** From this growth on, in shares of the pixels and as a factor, a calibration should be measured anew. */
const GROWN_BY = 0.02;
const GROWN_TIMES = 2;

/** How a calibration does, and whether it has grown worse. */
export function driftOf({ invalid_share, invalid_share_at_capture }: NonNullable<CalibrationDocument["drift"]>): {
  words: string;
  grown: boolean;
} {
  const now = fixed(100 * invalid_share, 1, "%");
  const before = invalid_share_at_capture;
  if (before === null) return { words: `${now} of the pixels contradict themselves.`, grown: false };
  const grown = invalid_share - before > GROWN_BY && invalid_share > GROWN_TIMES * before;
  const words = `${now} of the pixels contradict themselves; ${fixed(100 * before, 1, "%")} when it was measured.`;
  return { words: grown ? `${words} It should be measured anew.` : words, grown };
}
