import type { Coefficients } from "../physics/maximumEntropy";

/** Layers of four numbers a pixel that hold E and a_1 to a_m. */
export function layersOf(harmonics: number): number {
  return Math.ceil((harmonics + 1) / 2);
}

/**
 * Gathers planes into texels of four numbers, two complex ones: a_2l and a_(2l+1) in layer l, with E in
 * the place of a_0. A quarter of the fetches is most of the shader's speed where the processor renders.
 *
 * `texels` holds `layersOf(m)` images of four numbers a pixel; what no coefficient fills is not touched.
 */
export function packTexels({ planes, harmonics, width, height }: Coefficients, texels: Float32Array): void {
  const area = width * height;
  for (let plane = 0; plane <= 2 * harmonics; plane++) {
    const place = plane === 0 ? 0 : plane + 1; // the imaginary part of a_0 has no plane
    const from = plane * area;
    let to = 4 * area * (place >> 2) + (place & 3);
    for (let pixel = 0; pixel < area; pixel++, to += 4) texels[to] = planes[from + pixel];
  }
}
