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
