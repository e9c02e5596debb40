/** Slow and obvious: Eq. (2) by a dense solve, to hold the page's arithmetic against. */

import type { Coefficients } from "../../client/dashboard/src/physics/maximumEntropy";

export interface Complex {
  readonly re: number;
  readonly im: number;
}

export const complex = (re: number, im = 0): Complex => ({ re, im });
const add = (a: Complex, b: Complex): Complex => complex(a.re + b.re, a.im + b.im);
const sub = (a: Complex, b: Complex): Complex => complex(a.re - b.re, a.im - b.im);
export const mul = (a: Complex, b: Complex): Complex => complex(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
const conj = (a: Complex): Complex => complex(a.re, -a.im);
const abs2 = (a: Complex): number => a.re * a.re + a.im * a.im;
const div = (a: Complex, b: Complex): Complex => {
  const n = mul(a, conj(b));
  return complex(n.re / abs2(b), n.im / abs2(b));
};
export const cis = (phase_rad: number): Complex => complex(Math.cos(phase_rad), Math.sin(phase_rad));

/** Light of one delay: its phase at the base frequency and its weight. */
export interface Return {
  readonly phase_rad: number;
  readonly weight: number;
}

/** b_0 to b_m of some returns over light spread evenly with weight `uniform` (Sec. 3.1). */
export function momentsOf(returns: readonly Return[], uniform: number, m: number): Complex[] {
  return Array.from({ length: m + 1 }, (_, j) =>
    returns.reduce((sum, { phase_rad, weight }) => add(sum, mul(complex(weight), cis(j * phase_rad))), complex(j === 0 ? uniform : 0)),
  );
}

/** x with B x = y, B[j][k] = b_(j-k), by Gaussian elimination with pivoting; y is e_0 unless given. */
function solveToeplitz(b: readonly Complex[], y: readonly Complex[] = b.map((_, j) => complex(j === 0 ? 1 : 0))): Complex[] {
  const n = b.length;
  const rows = Array.from({ length: n }, (_, j) => [...Array.from({ length: n }, (_, k) => (j >= k ? b[j - k] : conj(b[k - j]))), y[j]]);
  for (let column = 0; column < n; column++) {
    let best = column;
    for (let row = column; row < n; row++) if (abs2(rows[row][column]) > abs2(rows[best][column])) best = row;
    [rows[column], rows[best]] = [rows[best], rows[column]];
    for (let row = 0; row < n; row++) {
      if (row === column) continue;
      const factor = div(rows[row][column], rows[column][column]);
      rows[row] = rows[row].map((value, k) => sub(value, mul(factor, rows[column][k])));
    }
  }
  return rows.map((row, k) => div(row[n], row[k]));
}

/** Planes of one pixel as the service streams them: E, Re a_1, Im a_1, ... with a = E B^-1 e_0. */
export function coefficientsOf(b: readonly Complex[]): number[] {
  const x = solveToeplitz(b);
  const E = 1 / x[0].re;
  return [E, ...x.slice(1).flatMap((value) => [E * value.re, E * value.im])];
}

/** h(phi) = e_0' B^-1 e_0 / (2 pi |sum_j conj(x_j) exp(i j phi)|^2) with x = B^-1 e_0 (Theorem 1). */
export function densityOf(b: readonly Complex[], phase_rad: number): number {
  const x = solveToeplitz(b);
  const sum = x.reduce((total, value, j) => add(total, mul(conj(value), cis(j * phase_rad))), complex(0));
  return x[0].re / (2 * Math.PI * abs2(sum));
}

/** Coefficients of a picture whose pixels have the given moments, at a base frequency of 23 MHz. */
export function picture(pixels: readonly (readonly Complex[])[], width = pixels.length): Coefficients {
  const harmonics = pixels[0].length - 1;
  const planes = new Float32Array((2 * harmonics + 1) * pixels.length);
  pixels.forEach((moments, pixel) => {
    coefficientsOf(moments).forEach((value, plane) => (planes[plane * pixels.length + pixel] = value));
  });
  return { planes, harmonics, width, height: pixels.length / width, baseFrequency_hz: 23e6 };
}

/**
 * Sharp bounds per radian on every density with moments `b`, smoothed with the Poisson kernel of `radius`
 * (Sec. 5.2): with w = radius exp(i phi), W_j = w^j and p_j = sum_(k<j) w^k b_(j-k) + w^j b_0 / 2,
 *
 *     kappa = W* B^-1 W,  F = (2 / kappa) (1 / (1 - r^2) - W* B^-1 p),  R = 2 r^(m+1) / ((1 - r^2) kappa).
 */
export function boundsOf(b: readonly Complex[], phase_rad: number, radius: number): { lower: number; upper: number } {
  const m = b.length - 1;
  const W = b.map((_, j) => mul(complex(radius ** j), cis(j * phase_rad)));
  const p = b.map((_, j) => W.slice(0, j).reduce((sum, w, k) => add(sum, mul(w, b[j - k])), mul(W[j], complex(b[0].re / 2))));
  const dot = (x: readonly Complex[]): Complex => x.reduce((sum, value, j) => add(sum, mul(conj(W[j]), value)), complex(0));
  const kappa = dot(solveToeplitz(b, W)).re;
  const centre = (2 / kappa) * (1 / (1 - radius ** 2) - dot(solveToeplitz(b, p)).re);
  const size = (2 * radius ** (m + 1)) / ((1 - radius ** 2) * kappa);
  return { lower: (centre - size) / (2 * Math.PI), upper: (centre + size) / (2 * Math.PI) };
}
