/** What is plotted of a pixel: curves over time of flight, by what is asked of it. */
import { impulseResponse, peaks, phasesAround } from "../../physics/impulseResponse";
import type { Coefficients } from "../../physics/maximumEntropy";
import { Poles } from "../../physics/poles";
import { boundsAt, pixelOf, poissonKernel } from "../../physics/reflection";
import type { Pin, PinName } from "../../store/measures";
import type { PixelDocument } from "../../stream/documents";
import type { Rows } from "../../ui/download";
import type { Aspect } from "./sides";

export type Truth = NonNullable<PixelDocument["truth"]>;

/** Curves over the same times; their aspect says what they are. */
export interface Curves {
  readonly aspect: Aspect;
  readonly time_ns: Float64Array;
  /** Units of b_0 per ns, or of b_0 for what is cumulative. */
  readonly lines: readonly Float64Array[];
}

/** The lines of each aspect, in their order, as the columns of a table call them. */
const LINES: Readonly<Record<Aspect, readonly string[]>> = {
  density: ["density"],
  bounds: ["lower", "upper", "smoothed", "truth_smoothed"],
  cumulative: ["cumulative", "truth_cumulative"],
};

/** Which line of an aspect is the estimate. */
export const ESTIMATES: Readonly<Record<Aspect, number>> = { density: 0, bounds: 2, cumulative: 0 };

const TURN = 2 * Math.PI;
/** Even samples of a curve, beside those around its peaks. */
const SAMPLES = 513;
/** Least share of the light that makes a peak worth finer samples around it. */
const LEAST_SHARE = 0.02;
/** Returns of the truth that hold less than this of its light do not tell what all of it would look like. */
const COMPLETE = 0.999;

/** A pixel of a frame. */
export type Subject = Readonly<{ coefficients: Coefficients; index: number }>;

/** What is drawn of a pixel. */
export interface Drawn {
  readonly curves: Curves;
  /** The estimate of each pin within the picture, at the times of the curves. */
  readonly ofPins: PinLines;
}

export type PinLines = ReadonlyMap<PinName, Float64Array>;

/** The curves of a pixel, and the estimates of the pins beside them. */
export function drawnOf(aspect: Aspect, { coefficients: c, index }: Subject, pins: readonly Pin[], truth: Truth | null): Drawn {
  const inside = pins.filter(({ x, y }) => x < c.width && y < c.height).map(({ name, x, y }) => [name, y * c.width + x] as const);
  // All at the same times, which are finer around each one's peaks.
  const pixels = [index, ...inside.map(([, pixel]) => pixel)];
  const peaked = pixels.map((pixel) => ({ pixel, peaks: peaks(c, pixel).filter(({ share }) => share >= LEAST_SHARE) }));
  const phases_rad = phasesAround(c, SAMPLES, peaked);
  return {
    curves: curvesOf(aspect, c, index, phases_rad, truth),
    ofPins: new Map(inside.map(([name, pixel]) => [name, curvesOf(aspect, c, pixel, phases_rad, null).lines[ESTIMATES[aspect]]])),
  };
}

/** The curves of one pixel. `truth` is drawn beside them where it is complete. */
function curvesOf(aspect: Aspect, c: Coefficients, pixel: number, phases_rad: Float64Array, truth: Truth | null): Curves {
  const response = impulseResponse(c, pixel, phases_rad);
  const time_ns = response.time_s.map((time_s) => time_s * 1e9);
  const whole = wholeOf(truth);
  if (aspect === "density") return { aspect, time_ns, lines: [response.density.map((value) => value * 1e-9)] };
  const made = LINES[aspect].map(() => new Float64Array(time_ns.length).fill(NaN));
  if (aspect === "bounds") {
    const levinson = pixelOf(c, pixel);
    const perNs = TURN * c.baseFrequency_hz * 1e-9;
    phases_rad.forEach((phase, n) => {
      if (levinson !== null) {
        const { lower, upper, smoothed } = boundsAt(levinson, phase);
        [made[0][n], made[1][n], made[2][n]] = [perNs * lower, perNs * upper, perNs * smoothed];
      }
      if (whole === null) return;
      made[3][n] =
        perNs *
        whole.returns.reduce((sum, { time_s, weight }) => sum + weight * poissonKernel(phase - TURN * c.baseFrequency_hz * time_s), 0);
    });
  } else {
    const poles = new Poles(c.harmonics, 1);
    poles.findOne(c, pixel, 0);
    phases_rad.forEach((phase, n) => {
      made[0][n] = poles.upTo(0, phase);
      if (whole === null) return;
      made[1][n] = whole.returns.reduce((sum, { time_s, weight }) => sum + (time_s * 1e9 <= time_ns[n] ? weight : 0), 0);
    });
  }
  return { aspect, time_ns, lines: made };
}

function wholeOf(truth: Truth | null): Truth | null {
  if (truth === null) return null;
  const listed = truth.returns.reduce((sum, { weight }) => sum + weight, 0);
  return listed >= COMPLETE * truth.brightness ? truth : null;
}

/** A table of the curves: a row a time, units in the names of the columns. */
export function rowsOf({ curves: { aspect, time_ns, lines }, ofPins }: Drawn): Rows {
  const unit = aspect === "cumulative" ? "dn" : "dn_per_ns";
  const estimate = LINES[aspect][ESTIMATES[aspect]];
  const named = [
    ...lines.map((line, at) => ({ line, name: LINES[aspect][at] })),
    ...Array.from(ofPins, ([name, line]) => ({ line, name: `pin_${name.toLowerCase()}_${estimate}` })),
  ];
  const kept = named.filter(({ line }) => line.some((value) => !Number.isNaN(value)));
  const head = ["time_ns", ...kept.map(({ name }) => `${name}_${unit}`)];
  return [
    head,
    ...Array.from(time_ns, (time, n) => [time, ...kept.map(({ line }) => line[n])].map((value) => Number(value.toPrecision(9)))),
  ];
}
