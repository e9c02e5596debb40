/**
 * The maximum entropy density of Eq. (2), evaluated where it is looked at:
 *
 *     h(phi) = E / (2 pi |sum_j conj(a_j) exp(i j phi)|^2),   a_0 = 1,
 *
 * from coefficients as the service streams them: planes [E, Re a_1, Im a_1, ..., Re a_m, Im a_m].
 * The density per second of time of flight is g(tau) = 2 pi f h(2 pi f tau), so the 2 pi cancels.
 */

/** One frame of coefficients: `planes` holds 2 m + 1 images of `width` x `height`, row by row. */
export type Coefficients = Readonly<{ planes: Float32Array; harmonics: number; width: number; height: number; baseFrequency_hz: number }>;

/** |sum_j conj(a_j) z^j|^2 of one pixel by Horner's rule, z = exp(i phi) = (re, im). */
function squaredModulus(c: Coefficients, pixel: number, re: number, im: number): number {
  const area = c.width * c.height;
  const { planes, harmonics } = c;
  let pRe = 0;
  let pIm = 0;
  for (let j = harmonics; j >= 1; j--) {
    const sumRe = pRe + planes[(2 * j - 1) * area + pixel];
    const sumIm = pIm - planes[2 * j * area + pixel];
    pRe = sumRe * re - sumIm * im;
    pIm = sumRe * im + sumIm * re;
  }
  pRe += 1;
  return pRe * pRe + pIm * pIm;
}

/** Density of pixel `pixel` at `phase_rad`, in units of b_0 per second. NaN without a density. */
export function densityAt(c: Coefficients, pixel: number, phase_rad: number): number {
  const modulus = squaredModulus(c, pixel, Math.cos(phase_rad), Math.sin(phase_rad));
  return (c.planes[pixel] * c.baseFrequency_hz) / modulus;
}
