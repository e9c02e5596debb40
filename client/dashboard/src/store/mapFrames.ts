/** The newest frame of each map: as the service computes it, or as this page measures it over frames. */
import { computed, type ReadonlySignal } from "@preact/signals";

import { summariseMap } from "../stream/summary";
import type { Frame, Frames } from "./frames";
import type { MapProduct } from "./mapCatalogue";
import type { Noises } from "./noise";

/** The newest frame of a map; null until one arrived. Computed only while a view shows it. */
export function mapFrame(frames: Frames, noises: Noises, { product, unit, scatterOf }: MapProduct): ReadonlySignal<Frame | null> {
  if (scatterOf === undefined) return frames.of(product);
  const [noise, measured] = [noises.of(scatterOf), frames.of(scatterOf)];
  return computed(() => {
    const newest = measured.value;
    if (newest === null || noise.frames.value === 0) return null;
    const values = noise.map();
    return { ...newest, product, unit, values, map: summariseMap(values) };
  });
}
