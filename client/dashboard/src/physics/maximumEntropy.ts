/**
 * The maximum entropy density of Eq. (2), evaluated where it is looked at:
 *
 *     h(phi) = E / (2 pi |sum_j conj(a_j) exp(i j phi)|^2),   a_0 = 1,
 *
 * from coefficients as the service streams them: planes [E, Re a_1, Im a_1, ..., Re a_m, Im a_m].
 * The density per second of time of flight is g(tau) = 2 pi f h(2 pi f tau), so the 2 pi cancels.
 */

/** One frame of coefficients: `planes` holds 2 m + 1 images of `width` x `height`, row by row. */
export interface Coefficients {
  readonly planes: Float32Array;
  readonly harmonics: number;
  readonly width: number;
  readonly height: number;
  readonly baseFrequency_hz: number;
}

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

/** Density of every pixel at `phase_rad`, in units of b_0 per second, written into `out`. */
export function densityImage(c: Coefficients, phase_rad: number, out: Float32Array): void {
  const area = c.width * c.height;
  const { planes, harmonics } = c;
  const re = Math.cos(phase_rad);
  const im = Math.sin(phase_rad);
  // The inner loop of the fallback renderer: the same sum as squaredModulus, kept free of calls.
  for (let pixel = 0; pixel < area; pixel++) {
    let pRe = 0;
    let pIm = 0;
    for (let j = harmonics, at = 2 * harmonics * area + pixel; j >= 1; j--, at -= 2 * area) {
      const sumRe = pRe + planes[at - area];
      const sumIm = pIm - planes[at];
      pRe = sumRe * re - sumIm * im;
      pIm = sumRe * im + sumIm * re;
    }
    pRe += 1;
    out[pixel] = (planes[pixel] * c.baseFrequency_hz) / (pRe * pRe + pIm * pIm);
  }
}

/** The impulse response of one pixel over one period of the base frequency. */
export interface ImpulseResponse {
  readonly time_s: Float64Array;
  /** Units of b_0 per second; all NaN where the pixel has no density. */
  readonly density: Float64Array;
}

/** Samples the density of one pixel at `count` times, evenly over [0, 1/f]. */
export function impulseResponse(c: Coefficients, pixel: number, count: number): ImpulseResponse {
  const time_s = new Float64Array(count);
  const density = new Float64Array(count);
  const period_s = 1 / c.baseFrequency_hz;
  for (let n = 0; n < count; n++) {
    time_s[n] = (period_s * n) / (count - 1);
    density[n] = densityAt(c, pixel, (2 * Math.PI * n) / (count - 1));
  }
  return { time_s, density };
}

/** A local maximum of a pixel's density and the light between the minima around it. */
export interface Peak {
  readonly time_s: number;
  /** Units of b_0 per second. */
  readonly density: number;
  /** Share of the pixel's light between the neighbouring minima, 0 to 1. */
  readonly share: number;
}

/** Golden-section search for the largest value of `f` in [low, high], where it has one maximum. */
function maximise(f: (x: number) => number, low: number, high: number): number {
  const ratio = (Math.sqrt(5) - 1) / 2;
  for (let step = 0; step < 40; step++) {
    const left = high - ratio * (high - low);
    const right = low + ratio * (high - low);
    if (f(left) > f(right)) high = right;
    else low = left;
  }
  return 0.5 * (low + high);
}

/**
 * The maxima of one pixel's density, strongest share first.
 *
 * Times are refined on the density itself, so they do not depend on `response`'s sampling; shares are
 * sums over that sampling. The response is periodic: light at the end of a period continues at its start.
 */
export function peaks(c: Coefficients, pixel: number, response: ImpulseResponse): Peak[] {
  const { density } = response;
  const count = density.length - 1; // the last sample repeats the first
  const period_s = 1 / c.baseFrequency_hz;
  const at = (n: number): number => density[((n % count) + count) % count];
  let total = 0;
  for (let n = 0; n < count; n++) total += at(n);
  if (!(total > 0 && Number.isFinite(total))) return [];

  const found: Peak[] = [];
  for (let n = 0; n < count; n++) {
    if (!(at(n) > at(n - 1) && at(n) >= at(n + 1))) continue;
    let light = at(n);
    for (let k = n + 1; k < n + count && at(k) < at(k - 1); k++) light += at(k);
    for (let k = n - 1; k > n - count && at(k) < at(k + 1); k--) light += at(k);
    const phase_rad = maximise(
      (phi) => densityAt(c, pixel, phi),
      (2 * Math.PI * (n - 1)) / count,
      (2 * Math.PI * (n + 1)) / count,
    );
    const turn = phase_rad / (2 * Math.PI);
    found.push({
      time_s: (turn - Math.floor(turn)) * period_s,
      density: densityAt(c, pixel, phase_rad),
      share: light / total,
    });
  }
  return found.sort((a, b) => b.share - a.share);
}
