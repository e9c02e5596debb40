/**
 * Light up to a time of flight, in closed form (Sec. 6.1 by partial fractions instead of quadrature).
 *
 * With the poles p_l of the density and its moments b_k = sum_l C_l p_l^k, the light up to phase phi is
 *
 *     [b_0 phi + 2 Im(S(phi) - S(0))] / (2 pi),   S(x) = sum_l C_l log(1 - p_l exp(-i x)).
 */
import type { Coefficients } from "./maximumEntropy";

const TURN = 2 * Math.PI;
/** Rounds of Aberth's iteration; a frame like the last needs few, as its poles start where those stood. */
const ROUNDS = 60;
const CONVERGED = 1e-13;
/** Poles closer than this are drawn apart: their shares would cancel each other to the last digit. */
const APART = 1e-7;

/** Poles and shares of every pixel of a picture. Eight numbers would do for two poles: (p, C) each as a pair. */
export class Poles {
  /** For each pixel m times: Re p, Im p, Re C, Im C. */
  readonly values: Float64Array;
  /** b_0 of each pixel; NaN where it has no density. */
  readonly brightness: Float64Array;
  /** S(0) of each pixel: 2 Im S(0). */
  readonly start: Float64Array;

  constructor(
    readonly harmonics: number,
    readonly area: number,
  ) {
    this.values = new Float64Array(4 * harmonics * area);
    this.brightness = new Float64Array(area).fill(NaN);
    this.start = new Float64Array(area);
  }

  /** Finds the poles of one pixel of `c`, beginning at those found before in the place `at`, and keeps them there. */
  findOne(c: Coefficients, pixel: number, at: number): void {
    const { harmonics: m, values } = this;
    const area = c.width * c.height;
    const energy = c.planes[pixel];
    const warm = Number.isFinite(this.brightness[at]);
    this.brightness[at] = NaN;
    if (!(energy > 0) || !Number.isFinite(energy)) return;
    const a = polynomial;
    a[0] = 1;
    a[1] = 0;
    for (let k = 1; k <= m; k++) {
      a[2 * k] = c.planes[(2 * k - 1) * area + pixel];
      a[2 * k + 1] = c.planes[2 * k * area + pixel];
      if (!Number.isFinite(a[2 * k] + a[2 * k + 1])) return;
    }
    const base = 4 * m * at;
    if (!warm) {
      for (let l = 0; l < m; l++) {
        values[base + 4 * l] = 0.9 * Math.cos((TURN * l) / m + 0.4);
        values[base + 4 * l + 1] = 0.9 * Math.sin((TURN * l) / m + 0.4);
      }
    }
    aberth(a, m, values, base);
    let brightness = 0;
    let start = 0;
    for (let l = 0; l < m; l++) {
      share(values, base, l, m, energy);
      const at4 = base + 4 * l;
      brightness += values[at4 + 2];
      start += imaginaryLog(values, at4, 1, 0);
    }
    this.start[at] = 2 * start;
    this.brightness[at] = brightness;
  }

  /** Light of pixel `at` up to `phase_rad`, in units of b_0; a turn more has all of its light more. */
  upTo(at: number, phase_rad: number): number {
    return this.#upTo(at, phase_rad, Math.cos(phase_rad), -Math.sin(phase_rad));
  }

  /** The same for every pixel, into `out`. */
  image(phase_rad: number, out: Float32Array): void {
    const re = Math.cos(phase_rad);
    const im = -Math.sin(phase_rad);
    for (let pixel = 0; pixel < this.area; pixel++) out[pixel] = this.#upTo(pixel, phase_rad, re, im);
  }

  #upTo(at: number, phase_rad: number, re: number, im: number): number {
    const { harmonics, values } = this;
    let sum = 0;
    for (let l = 0, at4 = 4 * harmonics * at; l < harmonics; l++, at4 += 4) sum += imaginaryLog(values, at4, re, im);
    return (this.brightness[at] * phase_rad + 2 * sum - this.start[at]) / TURN;
  }
}

/** Scratch: a_0 to a_m of the pixel at work, as pairs, for up to 32 harmonics. */
const polynomial = new Float64Array(2 * 33);

/** Im(C log(1 - p z)) of the pole at `at`, |p z| < 1. */
function imaginaryLog(values: Float64Array, at: number, zRe: number, zIm: number): number {
  const [pRe, pIm] = [values[at], values[at + 1]];
  const nearRe = 1 - (pRe * zRe - pIm * zIm);
  const nearIm = -(pRe * zIm + pIm * zRe);
  const stretch = 0.5 * Math.log(nearRe * nearRe + nearIm * nearIm);
  return values[at + 2] * Math.atan2(nearIm, nearRe) + values[at + 3] * stretch;
}

/** Aberth's iteration on z^m + a_1 z^(m-1) + ... + a_m, whose roots lie in the unit disc. */
function aberth(a: Float64Array, m: number, values: Float64Array, base: number): void {
  for (let round = 0; round < ROUNDS; round++) {
    let furthest = 0;
    for (let l = 0; l < m; l++) {
      const at = base + 4 * l;
      const [zRe, zIm] = [values[at], values[at + 1]];
      let [pRe, pIm, dRe, dIm] = [1, 0, 0, 0];
      for (let k = 1; k <= m; k++) {
        const dNext = dRe * zRe - dIm * zIm + pRe;
        dIm = dRe * zIm + dIm * zRe + pIm;
        dRe = dNext;
        const pNext = pRe * zRe - pIm * zIm + a[2 * k];
        pIm = pRe * zIm + pIm * zRe + a[2 * k + 1];
        pRe = pNext;
      }
      // step = p / (p' - p sum_j 1 / (z - z_j))
      let [sRe, sIm] = [0, 0];
      for (let j = 0; j < m; j++) {
        if (j === l) continue;
        const [xRe, xIm] = [zRe - values[base + 4 * j], zIm - values[base + 4 * j + 1]];
        const inverse = 1 / Math.max(xRe * xRe + xIm * xIm, 1e-300);
        sRe += xRe * inverse;
        sIm -= xIm * inverse;
      }
      const downRe = dRe - (pRe * sRe - pIm * sIm);
      const downIm = dIm - (pRe * sIm + pIm * sRe);
      const inverse = 1 / (downRe * downRe + downIm * downIm);
      if (!Number.isFinite(inverse)) continue;
      const stepRe = (pRe * downRe + pIm * downIm) * inverse;
      const stepIm = (pIm * downRe - pRe * downIm) * inverse;
      values[at] = zRe - stepRe;
      values[at + 1] = zIm - stepIm;
      furthest = Math.max(furthest, Math.abs(stepRe) + Math.abs(stepIm));
    }
    if (furthest < CONVERGED) break;
  }
  for (let l = 1; l < m; l++) {
    for (let j = 0; j < l; j++) {
      const distance = Math.hypot(values[base + 4 * l] - values[base + 4 * j], values[base + 4 * l + 1] - values[base + 4 * j + 1]);
      if (distance < APART) values[base + 4 * l] *= 1 - 2 * APART * (l + 1);
    }
  }
}

/** C_l = E p_l^(m-1) / (prod_(j != l) (p_l - p_j) prod_j (1 - conj(p_j) p_l)): the residue of the density. */
function share(values: Float64Array, base: number, l: number, m: number, energy: number): void {
  const [zRe, zIm] = [values[base + 4 * l], values[base + 4 * l + 1]];
  let [upRe, upIm, downRe, downIm] = [energy, 0, 1, 0];
  for (let j = 0; j < m; j++) {
    const [qRe, qIm] = [values[base + 4 * j], values[base + 4 * j + 1]];
    const [mRe, mIm] = [1 - (qRe * zRe + qIm * zIm), -(qRe * zIm - qIm * zRe)];
    [downRe, downIm] = [downRe * mRe - downIm * mIm, downRe * mIm + downIm * mRe];
    if (j === l) continue;
    const [xRe, xIm] = [zRe - qRe, zIm - qIm];
    [downRe, downIm] = [downRe * xRe - downIm * xIm, downRe * xIm + downIm * xRe];
    [upRe, upIm] = [upRe * zRe - upIm * zIm, upRe * zIm + upIm * zRe];
  }
  const inverse = 1 / (downRe * downRe + downIm * downIm);
  values[base + 4 * l + 2] = (upRe * downRe + upIm * downIm) * inverse;
  values[base + 4 * l + 3] = (upIm * downRe - upRe * downIm) * inverse;
}
