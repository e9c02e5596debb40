/** What a view needs to know of a whole frame before it draws: computed in the worker. */
import { densityImage } from "../physics/densityImage";
import type { Coefficients } from "../physics/maximumEntropy";
import type { Span } from "../scales/scale";
import type { FrameMessage } from "./protocol";

/** Summary of coefficients: how bright light gets, and when it arrives. */
export interface LightSummary {
  /** Density that all but the brightest of the pixels' peaks stay below, in units of b_0 per second. */
  readonly peak: number;
  /** Mean density over the picture at evenly spaced times over one period, last excluded. */
  readonly arrivals: Float32Array;
}

const MAP_SAMPLES = 4096;
const LIGHT_SAMPLES = 600;
export const ARRIVAL_TIMES = 192;

/** The 2nd and 98th percentile of the numbers among `values`, from at most `MAP_SAMPLES` of them. */
export function summariseMap(values: ArrayLike<number>): Span {
  const stride = Math.max(1, Math.floor(values.length / MAP_SAMPLES));
  const sample: number[] = [];
  for (let at = 0; at < values.length; at += stride) {
    if (Number.isFinite(values[at])) sample.push(values[at]);
  }
  if (sample.length === 0) return { low: NaN, high: NaN };
  const sorted = Float64Array.from(sample).sort();
  const quantile = (q: number): number => sorted[Math.round(q * (sorted.length - 1))];
  return { low: quantile(0.02), high: quantile(0.98) };
}

/** Brightness and arrival times of the light in a frame, from a sample of its pixels. */
export function summariseLight(coefficients: Coefficients): LightSummary {
  const sample = sampleOf(coefficients);
  const arrivals = new Float32Array(ARRIVAL_TIMES);
  const count = sample.width;
  if (count === 0) return { peak: NaN, arrivals };
  const density = new Float32Array(count);
  const highest = new Float32Array(count);
  for (let n = 0; n < ARRIVAL_TIMES; n++) {
    densityImage(sample, (2 * Math.PI * n) / ARRIVAL_TIMES, density);
    let sum = 0;
    for (let pixel = 0; pixel < count; pixel++) {
      if (!Number.isFinite(density[pixel])) continue;
      sum += density[pixel];
      if (density[pixel] > highest[pixel]) highest[pixel] = density[pixel];
    }
    arrivals[n] = sum / count;
  }
  return { peak: highest.sort()[Math.round(0.9 * (count - 1))], arrivals };
}

/** About `LIGHT_SAMPLES` of the pixels that have light, in one row. */
function sampleOf(coefficients: Coefficients): Coefficients {
  const { planes, harmonics, width, height } = coefficients;
  const area = width * height;
  // A stride that shares no factor with the width meets every column.
  let stride = Math.max(1, Math.floor(area / LIGHT_SAMPLES));
  while (stride > 1 && width % stride === 0) stride -= 1;
  const pixels: number[] = [];
  for (let pixel = 0; pixel < area; pixel += stride) {
    if (planes[pixel] > 0) pixels.push(pixel); // E = 0 or NaN: no light here
  }
  const count = pixels.length;
  const sampled = new Float32Array((2 * harmonics + 1) * count);
  for (let plane = 0; plane <= 2 * harmonics; plane++) {
    for (let n = 0; n < count; n++) sampled[plane * count + n] = planes[plane * area + pixels[n]];
  }
  return { ...coefficients, planes: sampled, width: count, height: 1 };
}

/** Coefficients of a frame message; null when its shape is not that of coefficients. */
export function coefficientsOf({ array, meta }: FrameMessage): Coefficients | null {
  const [layers, height, width] = array.shape;
  if (array.shape.length !== 3 || layers % 2 !== 1 || !(array.data instanceof Float32Array)) return null;
  return { planes: array.data, harmonics: (layers - 1) / 2, width, height, baseFrequency_hz: meta.base_frequency_hz };
}

/** A frame on its way to the page, with what views need to know of it as a whole. */
export interface FrameReport {
  readonly type: "frame";
  readonly message: FrameMessage;
  /** Where most of the values of a map lie. */
  readonly map: Span | null;
  readonly light: LightSummary | null;
}

/** A frame with what its views need to know of it as a whole. */
export function summarised(message: FrameMessage): FrameReport {
  const coefficients = message.product === "coefficients" ? coefficientsOf(message) : null;
  return {
    type: "frame",
    message,
    map: message.array.shape.length === 2 ? summariseMap(message.array.data) : null,
    light: coefficients === null ? null : summariseLight(coefficients),
  };
}
