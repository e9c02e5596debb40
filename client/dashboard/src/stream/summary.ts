/** What a view needs to know of a whole frame before it draws: computed in the worker. */
import { type Coefficients, densityAt } from "../physics/maximumEntropy";
import type { Span } from "../ui/scale";
import type { FrameMessage } from "./protocol";

/** Summary of a map: where most of its values lie. */
export interface MapSummary extends Span {
  /** Share of the pixels that have a value. */
  readonly valid: number;
}

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
export function summariseMap(values: ArrayLike<number>): MapSummary {
  const stride = Math.max(1, Math.floor(values.length / MAP_SAMPLES));
  const sample: number[] = [];
  let seen = 0;
  for (let at = 0; at < values.length; at += stride, seen++) {
    if (Number.isFinite(values[at])) sample.push(values[at]);
  }
  if (sample.length === 0) return { low: NaN, high: NaN, valid: 0 };
  const sorted = Float64Array.from(sample).sort();
  const quantile = (q: number): number => sorted[Math.round(q * (sorted.length - 1))];
  return { low: quantile(0.02), high: quantile(0.98), valid: sample.length / seen };
}

/** Brightness and arrival times of the light in a frame, from a sample of its pixels. */
export function summariseLight(coefficients: Coefficients): LightSummary {
  const area = coefficients.width * coefficients.height;
  // A stride that shares no factor with the width meets every column.
  let stride = Math.max(1, Math.floor(area / LIGHT_SAMPLES));
  while (stride > 1 && coefficients.width % stride === 0) stride -= 1;
  const arrivals = new Float32Array(ARRIVAL_TIMES);
  const highest: number[] = [];
  for (let pixel = 0; pixel < area; pixel += stride) {
    if (!(coefficients.planes[pixel] > 0)) continue; // E = 0 or NaN: no light here
    let top = 0;
    for (let n = 0; n < ARRIVAL_TIMES; n++) {
      const density = densityAt(coefficients, pixel, (2 * Math.PI * n) / ARRIVAL_TIMES);
      if (!Number.isFinite(density)) continue;
      arrivals[n] += density;
      if (density > top) top = density;
    }
    highest.push(top);
  }
  if (highest.length === 0) return { peak: NaN, arrivals };
  for (let n = 0; n < ARRIVAL_TIMES; n++) arrivals[n] /= highest.length;
  const sorted = Float64Array.from(highest).sort();
  return { peak: sorted[Math.round(0.9 * (sorted.length - 1))], arrivals };
}

/** Coefficients of a frame message; null when its shape is not that of coefficients. */
export function coefficientsOf({ array, meta }: FrameMessage): Coefficients | null {
  const [layers, height, width] = array.shape;
  if (array.shape.length !== 3 || layers % 2 !== 1 || !(array.data instanceof Float32Array)) return null;
  return {
    planes: array.data,
    harmonics: (layers - 1) / 2,
    width,
    height,
    baseFrequency_hz: meta.base_frequency_hz,
  };
}

/** A frame on its way to the page, with what views need to know of it as a whole. */
export interface FrameReport {
  readonly type: "frame";
  readonly message: FrameMessage;
  readonly map: MapSummary | null;
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
