/** What the maps are compared with: B, a frame that was kept or one of a recording; A is what is on screen. */
import { batch, computed, effect, type ReadonlySignal, type Signal, signal, untracked } from "@preact/signals";

import type { FrameMeta } from "../stream/documents";
import { summariseMap } from "../stream/summary";
import { LIVE, liveFrame, MADE, RequestError, recordingPath, refusalIn } from "./api";
import type { Cupboard } from "./cupboard";
import { type Frame, type Frames, frameOf, isWhole } from "./frames";
import { MAP_PRODUCTS } from "./mapCatalogue";
import type { RangeErrors } from "./rangeErrors";
import type { FrameLoader } from "./replay";
import { oneOf, type Settings } from "./settings";

/** A frame of a recording, by its id; or one that was kept, by its name, without a number. */
export interface Source {
  readonly of: string;
  readonly frame: number | null;
}

/** What a map panel shows of two frames. */
export const WAYS = ["A", "B", "difference", "wipe", "blink"] as const;
export type Way = (typeof WAYS)[number];

/** What says which differences of ranges mean something. */
const ERRORS = ["range_error", "trust"] as const;
const MAPS: readonly string[] = MAP_PRODUCTS.map(({ product }) => product);

export class Comparison {
  /** B; null while nothing is compared. */
  readonly source: Signal<Source | null>;
  /** What the map panels show, by their views. */
  readonly ways: Readonly<Record<string, Signal<Way>>>;
  /** Names of the frames that this browser keeps. */
  readonly kept = signal<readonly string[]>([]);
  /** Why B cannot be had; null if it can. */
  readonly trouble = signal<string | null>(null);
  /** Half of the 90 % interval of A - B of the range, in m: NaN where one has none, or is not trusted; null until all is known. */
  readonly error_m: ReadonlySignal<Float32Array | null>;
  /** Set by what talks to the worker. */
  loader: FrameLoader | null = null;
  readonly #b = signal<readonly Frame[]>([]);
  readonly #maps: ReadonlyMap<string, readonly [b: ReadonlySignal<Frame | null>, difference: ReadonlySignal<Frame | null>]>;
  readonly #computed = signal(0);
  #loaded = "";
  #loading = false;

  constructor(
    private readonly frames: Frames,
    errors: RangeErrors,
    settings: Settings,
    private readonly cupboard: Cupboard,
  ) {
    this.source = settings.of<Source | null>({
      link: "b",
      initial: null,
      // What this browser keeps means nothing elsewhere.
      text: (source) => (source?.frame == null ? "" : `${source.of}.${source.frame}`),
      parse: (text) => {
        const [, of, frame] = /^([A-Za-z0-9][\w-]{0,199})\.(\d{1,12})$/.exec(text) ?? [];
        return of === undefined ? undefined : { of, frame: Number(frame) };
      },
    });
    const way = (link: string): Signal<Way> =>
      settings.of<Way>({ link, initial: "A", ...oneOf(WAYS), text: (way) => (way === "A" ? "" : way) });
    this.ways = { map: way("way"), "second-map": way("way2") };
    const of = (product: string): Frame | null => this.#b.value.find((each) => each.product === product) ?? null;
    this.#maps = new Map(
      MAPS.map((product) => [product, [computed(() => of(product)), computed(() => minus(frames.of(product).value, of(product)))]]),
    );
    this.error_m = computed(() => {
      const maps = [...ERRORS.map((product) => errors.of(product).value), ...ERRORS.map(of)].flatMap((map) => map ?? []);
      const [error_a, trust_a, error_b, trust_b] = maps.map(({ values }) => values);
      if (maps.length < 4 || error_a.length !== error_b.length) return null;
      const known = (at: number): boolean => trust_a[at] === 0 && trust_b[at] === 0;
      return Float32Array.from(error_a).map((error, at) => (known(at) ? Math.hypot(error, error_b[at]) : NaN));
    });
    effect(() => {
      void [this.source.value, frames.wanted.value, this.#computed.value];
      untracked(() => void this.#load());
    });
  }

  /** A map of B; null where it has none, or it is not there yet. */
  b(product: string): ReadonlySignal<Frame | null> {
    return this.#of(product)[0];
  }

  /** A - B of a map; null where the two have no such map of the same size. */
  difference(product: string): ReadonlySignal<Frame | null> {
    return this.#of(product)[1];
  }

  /** Keeps all maps of the frame that is shown under a name, and compares with it. Raises RequestError. */
  async keep(shown: Frame, name: string): Promise<void> {
    await this.cupboard.put(name, await this.#whole(shown));
    await this.look();
    this.source.value = { of: name, frame: null };
    this.recompute(); // another frame may have had the name
  }

  /** Reads which frames are kept. Raises RequestError. */
  async look(): Promise<void> {
    this.kept.value = await this.cupboard.names();
  }

  async remove(name: string): Promise<void> {
    await this.cupboard.remove(name);
    await this.look();
  }

  /** B is another now, or computed otherwise. */
  recompute(): void {
    this.#computed.value += 1;
  }

  #of(product: string): readonly [ReadonlySignal<Frame | null>, ReadonlySignal<Frame | null>] {
    const map = this.#maps.get(product);
    if (map === undefined) throw new Error(`There is no map of ${product}.`);
    return map;
  }

  /** All maps that the service has of a frame; where that is gone, those that the page shows. */
  async #whole(shown: Frame): Promise<readonly Frame[]> {
    const wanted = [...MAPS, "trust"].filter((product) => this.frames.absent.peek()[product] === undefined);
    try {
      const path = shown.origin === LIVE ? liveFrame(shown.meta.frame) : shown.origin;
      return ((await this.loader?.(path, wanted)) ?? []).map((report) => frameOf(report, MADE));
    } catch (error) {
      const here = wanted.flatMap((product) => this.frames.of(product).peek() ?? []);
      const whole = here.filter(({ origin, meta }) => origin === shown.origin && meta.frame === shown.meta.frame && isWhole(meta));
      if (whole.length === 0) throw error;
      return whole.map((frame) => ({ ...frame, origin: MADE }));
    }
  }

  /** One frame at a time: what is chosen meanwhile comes after it. */
  async #load(): Promise<void> {
    if (this.#loading || this.loader === null) return;
    this.#loading = true;
    for (let wanted = this.#wanted(); wanted !== this.#loaded; wanted = this.#wanted()) {
      this.#loaded = wanted;
      try {
        for await (const frames of this.#had(this.source.peek(), this.loader))
          batch(() => ([this.#b.value, this.trouble.value] = [frames, null]));
      } catch (error) {
        batch(() => ([this.#b.value, this.trouble.value] = [[], refusalIn(error).message]));
      }
    }
    this.#loading = false;
  }

  /** Maps of B as they are had; of a recording computed as A is, its errors last, as they take longest. */
  async *#had(source: Source | null, loader: FrameLoader): AsyncGenerator<readonly Frame[]> {
    if (source === null) yield [];
    else if (source.frame === null) {
      const frames = await this.cupboard.get(source.of);
      if (frames === undefined) throw new RequestError({ title: `This browser keeps no frame “${source.of}”.` });
      yield frames;
    } else {
      const path = `${recordingPath(source.of)}/frames/${source.frame}?reconstruction=current`;
      const bring = async (products: readonly string[]) => (await loader(path, products)).map((report) => frameOf(report, path));
      const maps = await bring(this.#shown());
      yield maps;
      if (source === this.source.peek()) yield [...(await bring(ERRORS)), ...maps];
    }
  }

  /** The maps that views show. */
  #shown(): string[] {
    return this.frames.wanted.peek().filter((product) => MAPS.includes(product));
  }

  #wanted(): string {
    return JSON.stringify([this.source.peek(), this.#shown(), this.#computed.peek()]);
  }
}

function minus(a: Frame | null, b: Frame | null): Frame | null {
  if (a === null || b === null || a.shape.join() !== b.shape.join()) return null;
  const values = Float32Array.from(a.values);
  for (let at = 0; at < values.length; at++) values[at] -= b.values[at];
  return { ...a, origin: MADE, product: `${a.product}-difference`, values, map: summariseMap(values) };
}

/** A left of a share of the width, and B right of it. */
export function wiped(a: Frame, b: Frame, split: number): Frame {
  if (a.shape.join() !== b.shape.join()) return a;
  const [values, columns] = [b.values.slice(), a.shape[1]];
  for (let row = 0; row < values.length; row += columns) values.set(a.values.subarray(row, row + Math.round(split * columns)), row);
  return { ...a, origin: MADE, product: `${a.product}-wipe`, values };
}

/** Of the pixels whose difference has an error, the share that differ by more. */
export function beyondShare({ values }: Frame, errors: Float32Array): number {
  const known = errors.filter((error, at) => !Number.isNaN(error + values[at])).length;
  return errors.filter((error, at) => Math.abs(values[at]) > error).length / known;
}

const CONDITIONS: Partial<Record<keyof FrameMeta, string>> = {
  base_frequency_hz: "frequency",
  harmonics: "m",
  zeroth: "b₀",
  exposure_s: "exposure",
  takes: "takes",
  calibration_id: "calibration",
  estimator: "estimator",
};

/** What two frames were not measured or computed alike with, in words. */
export function differing(a: FrameMeta, b: FrameMeta): string[] {
  return Object.entries(CONDITIONS).flatMap(([key, word]) => (a[key as keyof FrameMeta] === b[key as keyof FrameMeta] ? [] : [word]));
}
