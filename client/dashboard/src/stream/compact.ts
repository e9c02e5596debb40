/** Arrays of frames in fewer bytes, back to what the page works with: codes of 16 bits, and parts of the picture. */

export type Numbers = Float32Array | Float64Array | Uint16Array | Uint8Array;

/** A product's encoding in codes; null where it has none. As `docs/stream.md` has them. */
export function codesFor(axes: readonly string[], dtype: string): string | null {
  const form = axes.join();
  if (form === "y,x") return dtype === "<f4" ? "u16" : null;
  return form === "coefficient,y,x" ? "reflection16" : null;
}

/** An image in even steps: `offset + scale * code`; code 0 is no value. */
export function decodeU16(codes: Uint16Array, scale: number, offset: number): Float32Array {
  const values = new Float32Array(codes.length);
  for (let at = 0; at < codes.length; at++) values[at] = codes[at] === 0 ? NaN : offset + scale * codes[at];
  return values;
}

const [ZERO, UNIT] = [32768, 32767];

/**
 * Coefficients of Eq. (2) from brightness and reflection coefficients in codes: planes of E, Re a_1, Im a_1 and so on.
 *
 * A code stands for u = (2 / pi) arcsin|g| g / |g|; Levinson's recursion makes a^(k)_i = a^(k-1)_i + g_k conj(a^(k-1)_(k-i))
 * with a^(k)_k = g_k, and E = b_0 prod (1 - |g_k|^2).
 */
export function decodeReflection16(codes: Uint16Array, brightness: Float32Array): Float32Array {
  const area = brightness.length;
  const harmonics = codes.length / (2 * area);
  const planes = new Float32Array((2 * harmonics + 1) * area);
  const [re, im] = [new Float64Array(harmonics + 1), new Float64Array(harmonics + 1)];
  for (let pixel = 0; pixel < area; pixel++) {
    let energy = brightness[pixel];
    for (let k = 1; k <= harmonics; k++) {
      const uRe = (codes[(2 * k - 2) * area + pixel] - ZERO) / UNIT;
      const uIm = (codes[(2 * k - 1) * area + pixel] - ZERO) / UNIT;
      const size = Math.sqrt(uRe * uRe + uIm * uIm);
      const sine = Math.sin(0.5 * Math.PI * size);
      const scale = size > 0 ? sine / size : 0;
      const gRe = uRe * scale;
      const gIm = uIm * scale;
      for (let i = 1, j = k - 1; i <= j; i++, j--) {
        const iRe = re[i];
        const iIm = im[i];
        const jRe = re[j];
        const jIm = im[j];
        re[i] = iRe + gRe * jRe + gIm * jIm;
        im[i] = iIm + gIm * jRe - gRe * jIm;
        re[j] = jRe + gRe * iRe + gIm * iIm;
        im[j] = jIm + gIm * iRe - gRe * iIm;
      }
      re[k] = gRe;
      im[k] = gIm;
      energy *= 1 - sine * sine;
    }
    planes[pixel] = energy;
    for (let k = 1; k <= harmonics; k++) {
      planes[(2 * k - 1) * area + pixel] = re[k];
      planes[2 * k * area + pixel] = im[k];
    }
  }
  return planes;
}

/** Which pixels of a frame an array has: columns and rows of a region, every so many of them. */
export type Cut = Readonly<{ region: readonly [x: number, y: number, width: number, height: number]; decimation: number }>;

/** Whether an array that is cut so has this pixel. */
export function has({ region: [x0, y0, columns, rows], decimation }: Cut, x: number, y: number): boolean {
  const [column, row] = [x - x0, y - y0];
  return column >= 0 && column < columns && row >= 0 && row < rows && column % decimation === 0 && row % decimation === 0;
}

/** Values of a map as it is drawn: a pixel that was left out like the next one above and left. */
export function spread(values: Numbers, { region: [x0, y0, columns, rows], decimation }: Cut, width: number): Numbers {
  if (decimation === 1) return values;
  const drawn = values.slice();
  for (let y = 0; y < rows; y++) {
    const to = (y0 + y) * width + x0;
    const from = to - (y % decimation) * width;
    for (let x = 0; x < columns; x++) drawn[to + x] = values[from + x - (x % decimation)];
  }
  return drawn;
}

/**
 * An array of part of a frame, (..., rows, columns), as one of all of its pixels.
 *
 * One that was left out has no value in a map; planes of coefficients and flags, which are drawn, have that of the next
 * one above and left. Outside of the region there are none.
 */
export function whole(
  data: Numbers,
  shape: readonly number[],
  { region: [x0, y0, columns, rows], decimation }: Cut,
  width: number,
  height: number,
): Numbers {
  const [cutRows, cutColumns] = shape.slice(-2);
  const planes = data.length / (cutRows * cutColumns);
  const made = data.constructor as new (length: number) => Numbers;
  const all = new made(planes * width * height);
  const real = all instanceof Float32Array || all instanceof Float64Array;
  const gaps = real && shape.length === 2;
  if (real && (gaps || columns < width || rows < height)) all.fill(NaN);
  const column = Uint16Array.from({ length: columns }, (_, x) => Math.floor(x / decimation));
  for (let plane = 0; plane < planes; plane++) {
    for (let y = 0; y < rows; y++) {
      const to = (plane * height + y0 + y) * width + x0;
      if (y % decimation > 0) {
        if (!gaps) all.copyWithin(to, to - width, to - width + columns);
        continue;
      }
      const from = (plane * cutRows + y / decimation) * cutColumns;
      const step = gaps ? decimation : 1;
      for (let x = 0; x < columns; x += step) all[to + x] = data[from + column[x]];
    }
  }
  return all;
}
