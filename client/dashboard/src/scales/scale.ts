/** Scales: how a measured value becomes a place between the two ends of a colour bar. */

export type ScaleKind = "linear" | "root" | "logarithmic";

export type Scale = Readonly<{ low: number; high: number; kind: ScaleKind }>;

/** A logarithmic scale never reaches further down than this share of its high end. */
const SMALLEST_SHARE = 1e-4;

/** The low end in use: a logarithm needs one above zero. */
function lowEnd(scale: Scale): number {
  return scale.kind !== "logarithmic" ? scale.low : Math.max(scale.low, scale.high * SMALLEST_SHARE);
}

/** Place of `value` between low (0) and high (1); NaN stays NaN, values beyond the ends pass them. */
export function fraction(scale: Scale, value: number): number {
  const low = lowEnd(scale);
  const share = (value - low) / (scale.high - low);
  if (scale.kind === "linear") return share;
  if (scale.kind === "root") return Math.sign(share) * Math.sqrt(Math.abs(share));
  return value > 0 ? Math.log(value / low) / Math.log(scale.high / low) : value <= 0 ? 0 : NaN;
}

/** The value at a place on the scale; inverse of `fraction` between the ends. */
export function valueAt(scale: Scale, place: number): number {
  const low = lowEnd(scale);
  if (scale.kind === "linear") return low + place * (scale.high - low);
  if (scale.kind === "root") return low + place * Math.abs(place) * (scale.high - low);
  return low * (scale.high / low) ** place;
}

/** The step of 1, 2 or 5 times a power of ten that cuts `span` into at most `count` parts. */
export function niceStep(span: number, count: number): number {
  const raw = span / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const factor = [1, 2, 5, 10].find((f) => f * power >= raw * (1 - 1e-9)) ?? 10;
  return factor * power;
}

/** A scale with fewer numbers beside it cannot be read. */
const FEWEST_TICKS = 3;
/** What powers of ten are written with, the first that gives enough numbers; within a decade evenly spaced ones tell more. */
const LOGARITHMIC_FACTORS: readonly (readonly number[])[] = [[1], [1, 2, 5]];

/** Powers of ten times these factors from one number to another. */
export function powersBetween(low: number, high: number, factors: readonly number[]): number[] {
  const values: number[] = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const factor of factors) {
      const value = factor * 10 ** power;
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) values.push(value);
    }
  }
  return values;
}

/** Values to write beside a colour bar: round numbers, at most about `count`. */
export function ticks(scale: Scale, count: number): number[] {
  const low = lowEnd(scale);
  if (!(scale.high > low)) return [];
  if (scale.kind === "logarithmic") {
    for (const factors of LOGARITHMIC_FACTORS) {
      const values = powersBetween(low, scale.high, factors);
      if (values.length >= FEWEST_TICKS) return values;
    }
  }
  const step = niceStep(scale.high - low, count);
  const values: number[] = [];
  const first = Math.ceil(low / step - 1e-9);
  for (let n = first; n * step <= scale.high + 1e-9 * step; n++) values.push(n * step + 0); // no minus zero
  return values;
}

/** Decimals that tell neighbouring ticks of `step` apart. */
export function decimalsFor(step: number): number {
  return Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
}

/** What a frame's values span: the 2nd and 98th percentile of those that are numbers. */
export type Span = Readonly<{ low: number; high: number }>;

/** The span around zero that holds a span. */
export function symmetric({ low, high }: Span): Span {
  const reach = Math.max(Math.abs(low), Math.abs(high));
  return { low: -reach, high: reach };
}

/** The span that holds both; the one where nothing of the other has a value. */
export function joined(one: Span | null, other: Span | null): Span | null {
  if (one === null || other === null || !(other.high >= other.low)) return one;
  return { low: Math.min(one.low, other.low), high: Math.max(one.high, other.high) };
}

/** Counts of values in `bins` even places of a scale from `first` to `last`; what lies beyond counts in the outermost. */
export function histogram(values: ArrayLike<number>, scale: Scale, bins: number, first = 0, last = 1, most = 20_000): Uint32Array {
  const counts = new Uint32Array(bins);
  const stride = Math.max(1, Math.floor(values.length / most));
  for (let at = 0; at < values.length; at += stride) {
    const place = (fraction(scale, values[at]) - first) / (last - first);
    if (!Number.isNaN(place)) counts[Math.min(bins - 1, Math.max(0, Math.floor(place * bins)))]++;
  }
  return counts;
}

/**
 * Limits that follow the data without trembling: the span widened to round numbers, and the previous
 * limits as long as the span lies within them and fills more than half of them.
 */
export function autoLimits(previous: Span | null, span: Span): Span {
  if (!(span.high >= span.low)) return previous ?? { low: 0, high: 1 };
  const within = previous !== null && span.low >= previous.low && span.high <= previous.high;
  if (within && span.high - span.low > 0.5 * (previous.high - previous.low)) return previous;
  const width = span.high - span.low || Math.abs(span.high) || 1;
  const step = niceStep(width, 6);
  // Half a step of room on either side, so that noise at the ends does not move them.
  const low = Math.floor((span.low - 0.25 * step) / step) * step;
  const high = Math.ceil((span.high + 0.25 * step) / step) * step;
  return { low: span.low >= 0 ? Math.max(0, low) : low, high };
}
