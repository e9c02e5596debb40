/**
 * One pixel's reflection coefficients, moments and sharp bounds, from its coefficients of Eq. (2).
 *
 * Complex numbers are pairs in Float64Arrays: real, imaginary.
 */
import type { Coefficients } from "./maximumEntropy";

/** The paper's radius of the Poisson kernel that densities are smoothed with (Fig. 7). */
export const RADIUS = 0.93;

/** What Levinson's recursion knows of a pixel. */
export interface Pixel {
  /** b_0 to b_m in units of b_0's, as pairs. */
  readonly moments: Float64Array;
  /** g_1 to g_m, |g_k| < 1, as pairs. */
  readonly reflection: Float64Array;
}

/**
 * Levinson's recursion backwards; null where the pixel has no density.
 *
 * a^(k-1)_i = (a^(k)_i - g_k conj(a^(k)_(k-i))) / (1 - |g_k|^2) with g_k = a^(k)_k, E_(k-1) = E_k / (1 - |g_k|^2),
 * and b_k = -sum_i a^(k)_i b_(k-i).
 */
export function pixelOf(c: Coefficients, pixel: number): Pixel | null {
  const { harmonics: m, planes } = c;
  const area = c.width * c.height;
  const orders: Float64Array[] = [];
  let a = new Float64Array(2 * m + 2);
  a[0] = 1;
  for (let k = 2; k < a.length; k++) a[k] = planes[(k - 1) * area + pixel];
  let energy = planes[pixel];
  const reflection = new Float64Array(2 * m);
  for (let k = m; k >= 1; k--) {
    orders[k] = a;
    const [re, im] = [a[2 * k], a[2 * k + 1]];
    const rest = 1 - re * re - im * im;
    if (!(rest > 0) || !(energy > 0)) return null;
    reflection.set([re, im], 2 * (k - 1));
    const lower = new Float64Array(2 * k);
    lower[0] = 1;
    for (let i = 1; i < k; i++) {
      const [oRe, oIm] = [a[2 * (k - i)], -a[2 * (k - i) + 1]];
      lower[2 * i] = (a[2 * i] - (re * oRe - im * oIm)) / rest;
      lower[2 * i + 1] = (a[2 * i + 1] - (re * oIm + im * oRe)) / rest;
    }
    a = lower;
    energy /= rest;
  }
  if (!Number.isFinite(energy)) return null;
  const moments = new Float64Array(2 * m + 2);
  moments[0] = energy;
  for (let k = 1; k <= m; k++) {
    for (let i = 1; i <= k; i++) {
      const [aRe, aIm, bRe, bIm] = [orders[k][2 * i], orders[k][2 * i + 1], moments[2 * (k - i)], moments[2 * (k - i) + 1]];
      moments[2 * k] -= aRe * bRe - aIm * bIm;
      moments[2 * k + 1] -= aRe * bIm + aIm * bRe;
    }
  }
  return { moments, reflection };
}

/** The least and the greatest smoothed density that moments allow, and that of the estimate. */
export type Bounds = Readonly<{ lower: number; upper: number; smoothed: number }>;

/**
 * Sharp bounds at `phase_rad` (Sec. 5.2, after Karlsson and Georgiou 2013), in units of b_0 per radian.
 *
 * The Caratheodory functions of all densities with these moments take the values of a disc at
 * w = radius exp(i phi): the image of |zeta| <= radius under the Mobius maps of the reflection coefficients,
 * the last one first. The estimate's own value is the image of zeta = 0.
 */
export function boundsAt({ moments, reflection }: Pixel, phase_rad: number, radius = RADIUS): Bounds {
  const scale = moments[0] / (2 * Math.PI);
  const [centre, size] = disc(reflection, phase_rad, radius, 1);
  const [smoothed] = disc(reflection, phase_rad, radius, 0);
  return { lower: (centre - size) * scale, upper: (centre + size) * scale, smoothed: smoothed * scale };
}

/** Centre and radius of the disc of Re F / b_0 that |zeta| <= spread * radius is mapped to. */
function disc(reflection: Float64Array, phase_rad: number, radius: number, spread: number): [number, number] {
  const [wRe, wIm] = [radius * Math.cos(phase_rad), radius * Math.sin(phase_rad)];
  let [cRe, cIm] = [0, 0];
  let size = spread * radius;
  for (let at = reflection.length - 2; at >= 0; at -= 2) {
    // (c, s) -> ((c + p) conj(1 + q c) - conj(q) s^2, |1 - p q| s) / (|1 + q c|^2 - |q|^2 s^2), p = -conj(g), q = -g
    const [gRe, gIm] = [reflection[at], reflection[at + 1]];
    const squared = gRe * gRe + gIm * gIm;
    const [belowRe, belowIm] = [1 - (gRe * cRe - gIm * cIm), -(gRe * cIm + gIm * cRe)];
    const inverse = 1 / (belowRe * belowRe + belowIm * belowIm - squared * size * size);
    const [aboveRe, aboveIm] = [cRe - gRe, cIm + gIm];
    const re = (aboveRe * belowRe + aboveIm * belowIm + gRe * size * size) * inverse;
    const im = (aboveIm * belowRe - aboveRe * belowIm - gIm * size * size) * inverse;
    [cRe, cIm] = [wRe * re - wIm * im, wRe * im + wIm * re];
    size = radius * size * (1 - squared) * inverse;
  }
  // F = (1 + zeta) / (1 - zeta) = -1 + 2 / (1 - zeta)
  const belowRe = 1 - cRe;
  const inverse = 1 / (belowRe * belowRe + cIm * cIm - size * size);
  return [2 * belowRe * inverse - 1, 2 * size * inverse];
}

/** A return of weight 1 at phase 0, smoothed with the Poisson kernel: per radian. */
export function poissonKernel(phase_rad: number, radius = RADIUS): number {
  return (1 - radius * radius) / (2 * Math.PI * (1 - 2 * radius * Math.cos(phase_rad) + radius * radius));
}
