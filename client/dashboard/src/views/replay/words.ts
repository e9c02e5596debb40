/** Durations and times of recordings, for people. */
import { fixed, NOTHING } from "../../scales/format";

/** A date as the reader's country writes it, and a time of 24 hours. */
export function clock(unix_s: number | null): string {
  if (unix_s === null) return NOTHING;
  return new Date(1000 * unix_s).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "medium", hourCycle: "h23" });
}

/** 4.2 s, 1:05 min, 2:03:04 h. */
export function duration(span_s: number): string {
  if (span_s < 59.95) return fixed(span_s, 1, "s");
  const whole = Math.round(span_s);
  const [hours, minutes, seconds] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (value: number): string => String(value).padStart(2, "0");
  return hours > 0 ? `${hours}:${two(minutes)}:${two(seconds)}\u202fh` : `${minutes}:${two(seconds)}\u202fmin`;
}
