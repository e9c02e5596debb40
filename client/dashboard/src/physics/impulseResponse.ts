/** One pixel's density as a curve: sampled where it bends, its peaks found and weighed. */
import { type Coefficients, densityAt } from "./maximumEntropy";
import { Poles } from "./poles";

const TURN = 2 * Math.PI;

/** A local maximum of a pixel's density and the light between the minima around it. */
export interface Peak {
  readonly phase_rad: number;
  readonly time_s: number;
  /** Units of b_0 per second. */
  readonly density: number;
  /** Share of the pixel's light between the neighbouring minima, 0 to 1. */
  readonly share: number;
}

/** The impulse response of one pixel over one period of the base frequency. */
export interface ImpulseResponse {
  /** Rising from 0 to 1/f, closer together where the density is sharp. */
  readonly time_s: Float64Array;
  /** Units of b_0 per second; NaN where the pixel has no density. */
  readonly density: Float64Array;
}

/** Scan points for each harmonic: 1/h is a trigonometric polynomial of degree m and hides nothing between them. */
const SCAN_PER_HARMONIC = 24;

/**
 * The maxima of one pixel's density, the one with most light first; none where it has no density.
 *
 * The response is periodic: light at the end of a period continues at its start.
 */
export function peaks(c: Coefficients, pixel: number): Peak[] {
  const density = (phase_rad: number): number => densityAt(c, pixel, phase_rad);
  const count = SCAN_PER_HARMONIC * (c.harmonics + 1);
  const step_rad = TURN / count;
  const scan = Float64Array.from({ length: count }, (_, n) => density(n * step_rad));
  if (!scan.every((value) => value > 0 && Number.isFinite(value))) return [];

  const at = (n: number): number => scan[(n + count) % count];
  const refine = (n: number, f: (phase_rad: number) => number): number => maximise(f, (n - 1) * step_rad, (n + 1) * step_rad);
  const tops: number[] = [];
  const bottoms: number[] = [];
  for (let n = 0; n < count; n++) {
    if (at(n) > at(n - 1) && at(n) >= at(n + 1)) tops.push(refine(n, density));
    if (at(n) < at(n - 1) && at(n) <= at(n + 1)) bottoms.push(refine(n, (phase_rad) => -density(phase_rad)));
  }
  const poles = new Poles(c.harmonics, 1);
  poles.findOne(c, pixel, 0);
  const light = tops.map((top) => {
    const low = bottoms.filter((bottom) => bottom < top).at(-1) ?? bottoms[bottoms.length - 1] - TURN;
    const high = bottoms.find((bottom) => bottom > top) ?? bottoms[0] + TURN;
    return poles.upTo(0, high) - poles.upTo(0, low);
  });
  const total = light.reduce((sum, value) => sum + value, 0);
  return tops
    .map((top, n) => {
      const phase_rad = top - TURN * Math.floor(top / TURN);
      return { phase_rad, time_s: phase_rad / TURN / c.baseFrequency_hz, density: density(top), share: light[n] / total };
    })
    .sort((a, b) => b.share - a.share);
}

/** Samples around a peak stand a quarter of its half width from it at first, then ever further by this factor. */
const SPREAD = 1.5;

/** A pixel and the peaks of it that are sampled more closely. */
export type Peaked = Readonly<{ pixel: number; peaks: readonly Peak[] }>;

/** `count` even phases over one turn, rising, and more around each pixel's peaks. */
export function phasesAround(c: Coefficients, count: number, around: readonly Peaked[]): Float64Array {
  const phases = Array.from({ length: count }, (_, n) => (TURN * n) / (count - 1));
  for (const { pixel, peaks: found } of around) {
    for (const peak of found) {
      phases.push(peak.phase_rad);
      // A tail falls with the square of the distance: it takes steps in proportion until the even ones are as fine.
      for (let distance = 0.25 * halfWidth(c, pixel, peak); distance < TURN / count; distance *= SPREAD) {
        phases.push(peak.phase_rad - distance, peak.phase_rad + distance);
      }
    }
  }
  return Float64Array.from(phases.filter((phase_rad) => phase_rad >= 0 && phase_rad <= TURN)).sort();
}

/** Samples the density at some phases. */
export function impulseResponse(c: Coefficients, pixel: number, phases_rad: Float64Array): ImpulseResponse {
  return {
    time_s: phases_rad.map((phase_rad) => phase_rad / TURN / c.baseFrequency_hz),
    density: phases_rad.map((phase_rad) => densityAt(c, pixel, phase_rad)),
  };
}

/** Half the width of a peak at half its height, from the curvature of 1/h at its top. */
function halfWidth(c: Coefficients, pixel: number, peak: Peak): number {
  // Halved until 1/h is a parabola there; then h falls to a half where 1/h has doubled.
  let width_rad = 0.1;
  for (let n = 0; n < 20; n++) {
    const inverse = 0.5 * (1 / densityAt(c, pixel, peak.phase_rad - width_rad) + 1 / densityAt(c, pixel, peak.phase_rad + width_rad));
    const rise = inverse * peak.density - 1;
    if (rise <= 2) return width_rad / Math.sqrt(Math.max(rise, 1e-3));
    width_rad /= 2;
  }
  return width_rad;
}

/** Golden-section search for the largest value of `f` in [low, high], where it has one maximum. */
function maximise(f: (x: number) => number, low: number, high: number): number {
  const ratio = (Math.sqrt(5) - 1) / 2;
  let [a, b] = [low, high];
  let [left, right] = [b - ratio * (b - a), a + ratio * (b - a)];
  let [fLeft, fRight] = [f(left), f(right)];
  for (let step = 0; step < 38; step++) {
    if (fLeft > fRight) {
      [b, right, fRight] = [right, left, fLeft];
      left = b - ratio * (b - a);
      fLeft = f(left);
    } else {
      [a, left, fLeft] = [left, right, fRight];
      right = a + ratio * (b - a);
      fRight = f(right);
    }
  }
  return 0.5 * (a + b);
}
