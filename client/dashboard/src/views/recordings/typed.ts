/** What is typed of a recording: limits, and annotations as lines of text, where values that are no text are written as JSON. */
import { numberOf } from "../../scales/format";
import type { RecordingRequest } from "../../stream/documents";

/** What is typed, empty for no limit, as the service takes it; null where it is none. */
export function limitsOf(
  typed: Readonly<Record<"duration_s" | "size_mb" | "frames", string>>,
): Pick<RecordingRequest, "duration_s" | "max_bytes" | "frames"> | null {
  const { duration_s, size_mb, frames } = typed;
  const [duration, size, count] = [duration_s, size_mb, frames].map((text) => (text.trim() === "" ? null : numberOf(text)));
  const sensible = (value: number | null): boolean => value === null || (Number.isFinite(value) && value > 0);
  if (![duration, size, count].every(sensible) || (count !== null && !Number.isInteger(count))) return null;
  return {
    ...(duration === null ? {} : { duration_s: duration }),
    ...(size === null ? {} : { max_bytes: Math.max(1, Math.round(1e6 * size)) }),
    ...(count === null ? {} : { frames: count }),
  };
}

export type Line = Readonly<{ name: string; text: string }>;

export function linesOf(annotations: Readonly<Record<string, unknown>>): Line[] {
  return Object.entries(annotations).map(([name, value]) => ({
    name,
    text: typeof value === "string" && !isJson(value) ? value : JSON.stringify(value),
  }));
}

/** What the lines say, without those that say nothing; null where a name is missing or stands twice. */
export function annotationsOf(lines: readonly Line[]): Record<string, unknown> | null {
  const said = lines.map(({ name, text }) => [name.trim(), text.trim()] as const).filter(([name, text]) => name !== "" || text !== "");
  const names = said.map(([name]) => name);
  if (names.includes("") || new Set(names).size !== names.length) return null;
  return Object.fromEntries(said.map(([name, text]) => [name, isJson(text) ? JSON.parse(text) : text]));
}

/** Whether a text would be read as something else than text: a number, a list, a quoted text. */
function isJson(text: string): boolean {
  try {
    JSON.parse(text);
    return true;
  } catch {
    return false;
  }
}
