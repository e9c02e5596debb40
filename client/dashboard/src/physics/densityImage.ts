/** The density of Eq. (2) in every pixel of a picture at one time: the inner loop of what draws without a graphics processor. */
import type { Coefficients } from "./maximumEntropy";

/** Pixels whose sums stay in the processor's first cache. */
const BLOCK = 2048;
const real = new Float64Array(BLOCK);
const imaginary = new Float64Array(BLOCK);

/**
 * Density of every pixel at `phase_rad`, in units of b_0 per second, written into `out`.
 *
 * Plane by plane over blocks of pixels: Horner's rule pixel by pixel reads 2 m + 1 places that lie far apart, and at
 * m = 8 takes twice as long.
 */
export function densityImage(c: Coefficients, phase_rad: number, out: Float32Array): void {
  const area = c.width * c.height;
  const { planes, harmonics } = c;
  for (let from = 0; from < area; from += BLOCK) {
    const count = Math.min(BLOCK, area - from);
    real.fill(1, 0, count); // a_0
    imaginary.fill(0, 0, count);
    for (let j = 1; j < harmonics; j += 2) addTwo(c, j, phase_rad, from, count);
    if (harmonics % 2 === 1) addOne(c, harmonics, phase_rad, from, count);
    for (let at = 0; at < count; at++) {
      const re = real[at];
      const im = imaginary[at];
      out[from + at] = (planes[from + at] * c.baseFrequency_hz) / (re * re + im * im);
    }
  }
}

/** Adds conj(a_j) exp(i j phi). */
function addOne({ planes, width, height }: Coefficients, j: number, phase_rad: number, from: number, count: number): void {
  const re = (2 * j - 1) * width * height + from;
  const im = re + width * height;
  const cos = Math.cos(j * phase_rad);
  const sin = Math.sin(j * phase_rad);
  for (let at = 0; at < count; at++) {
    real[at] += planes[re + at] * cos + planes[im + at] * sin;
    imaginary[at] += planes[re + at] * sin - planes[im + at] * cos;
  }
}

/** The same of j and j + 1, which reads and writes the sums once. */
function addTwo({ planes, width, height }: Coefficients, j: number, phase_rad: number, from: number, count: number): void {
  const area = width * height;
  const re = (2 * j - 1) * area + from;
  const im = re + area;
  const nextRe = im + area;
  const nextIm = nextRe + area;
  const cos = Math.cos(j * phase_rad);
  const sin = Math.sin(j * phase_rad);
  const nextCos = Math.cos((j + 1) * phase_rad);
  const nextSin = Math.sin((j + 1) * phase_rad);
  for (let at = 0; at < count; at++) {
    const [a, b, c, d] = [planes[re + at], planes[im + at], planes[nextRe + at], planes[nextIm + at]];
    real[at] += a * cos + b * sin + c * nextCos + d * nextSin;
    imaginary[at] += a * sin - b * cos + c * nextSin - d * nextCos;
  }
}
