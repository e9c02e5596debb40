/** What the maps are compared with: B, a frame that was kept or one of a recording; A is what is on screen. */
import { batch, computed, effect, type ReadonlySignal, type Signal, signal, untracked } from "@preact/signals";
import { del, get, keys, set } from "idb-keyval";

import type { FrameMeta } from "../stream/documents";
import { summariseMap } from "../stream/summary";
import { LIVE, liveFrame, MADE, RequestError, recordingPath, refusalIn } from "./api";
import { type Frame, type Frames, frameOf } from "./frames";
import type { RangeErrors } from "./rangeErrors";
import type { FrameLoader } from "./replay";
import { oneOf, type Settings } from "./settings";

/** A frame of a recording, by its id; or one that was kept, by its name, without a number. */
export type Source = Readonly<{ of: string; frame: number | null }>;

/** What a map panel shows of two frames. */
export const WAYS = ["A", "B", "difference", "wipe", "blink"] as const;
/** Changes a second that can be chosen for blinking: none is by key alone; three flashes a second are the most that is safe. */
export const BLINKS_HZ = [0, 0.5, 1, 2, 4] as const;
export type Way = (typeof WAYS)[number];

/** What says which differences of ranges mean something. */
const ERRORS = ["range_error", "trust"] as const;

/** A map of B, and A - B: null where there is none yet, or the two are not of the same size. */
type ComparedMap = Readonly<Record<"b" | "difference", ReadonlySignal<Frame | null>>>;

export class Comparison {
  /** B; null while nothing is compared. */
  readonly source: Signal<Source | null>;
  /** What the map panels show, by their views. */
  readonly ways: Readonly<Record<string, Signal<Way>>>;
  /** Whether blinking shows B at this moment, and how often a second it changes. */
  readonly blinked = signal(false);
  readonly blink_hz = signal<(typeof BLINKS_HZ)[number]>(2);
  /** Names of the frames that this browser keeps. */
  readonly kept = signal<readonly string[]>([]);
  /** Why B cannot be had; null if it can. */
  readonly trouble = signal<string | null>(null);
  /** Half of the 90 % interval of A - B of the range, in m: NaN where one has none, or is not trusted; null until all is known. */
  readonly error_m: ReadonlySignal<Float32Array | null>;
  /** Set by what talks to the worker. */
  loader: FrameLoader | null = null;
  readonly #b = signal<readonly Frame[]>([]);
  readonly #compared: Record<string, ComparedMap> = {};
  readonly #changes = signal(0);
  #asked = 0;

  constructor(
    private readonly frames: Frames,
    errors: RangeErrors,
    settings: Settings,
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
    const way = (link: string) => settings.of<Way>({ link, initial: "A", ...oneOf(WAYS), text: (now) => (now === "A" ? "" : now) });
    this.ways = { map: way("way"), "second-map": way("way2") };
    this.error_m = computed(() => {
      const maps = [...ERRORS.map((product) => errors.of(product).value), ...ERRORS.map((product) => this.#of(product))].flatMap(
        (map) => map ?? [],
      );
      const [error_a, trust_a, error_b, trust_b] = maps.map(({ values }) => values);
      if (maps.length < 4 || error_a.length !== error_b.length) return null;
      const known = (at: number): boolean => trust_a[at] === 0 && trust_b[at] === 0;
      return Float32Array.from(error_a).map((error, at) => (known(at) ? Math.hypot(error, error_b[at]) : NaN));
    });
    const shown = computed(() => frames.wanted.value.filter((product) => frames.maps.value.some((map) => map.product === product)).join());
    effect(() => {
      void this.#changes.value;
      const [source, maps] = [this.source.value, shown.value.match(/[\w-]+/g) ?? []];
      untracked(() => void this.#load(source, maps));
    });
  }

  /** A map of B, and of A - B. */
  of(product: string): ComparedMap {
    const b = computed(() => this.#of(product));
    this.#compared[product] ??= { b, difference: computed(() => minus(this.frames.of(product).value, b.value)) };
    return this.#compared[product];
  }

  #of(product: string): Frame | null {
    return this.#b.value.find((each) => each.product === product) ?? null;
  }

  /** Keeps all maps of the frame that is shown under a name, and compares with it. Raises RequestError. */
  async keep(shown: Frame, name: string): Promise<void> {
    const path = shown.origin === LIVE ? liveFrame(shown.meta.frame) : shown.origin;
    const wanted = [...this.frames.maps.peek().map(({ product }) => product), "trust"].filter(
      (product) => this.frames.absent.peek()[product] === undefined,
    );
    const frames = ((await this.loader?.(path, wanted)) ?? []).map((report) => frameOf(report, MADE));
    await stored(() => set(name, frames));
    this.source.value = { of: name, frame: null };
    this.recompute(); // another frame may have had the name
  }

  blink(): void {
    this.blinked.value = !this.blinked.peek();
  }

  /** Reads which frames are kept, without one that is to be removed. Raises RequestError. */
  async look(removed?: string): Promise<void> {
    if (removed !== undefined) await stored(() => del(removed));
    this.kept.value = await stored(() => keys<string>());
  }

  /** B is another now, or computed otherwise. */
  recompute(): void {
    this.#changes.value += 1;
  }

  /** Maps of B as they are had; of a recording computed as A is, its errors last, as they take longest. */
  async #load(source: Source | null, maps: readonly string[]): Promise<void> {
    const asked = ++this.#asked;
    const show = (frames: readonly Frame[], trouble: string | null = null): void => {
      if (asked === this.#asked) batch(() => ([this.#b.value, this.trouble.value] = [frames, trouble]));
    };
    try {
      if (source === null) show([]);
      else if (source.frame === null) {
        const frames = await stored(() => get<readonly Frame[]>(source.of));
        show(frames ?? [], frames === undefined ? `This browser keeps no frame “${source.of}”.` : null);
      } else {
        const path = `${recordingPath(source.of)}/frames/${source.frame}?reconstruction=current`;
        const bring = async (products: readonly string[]) =>
          ((await this.loader?.(path, products)) ?? []).map((report) => frameOf(report, path));
        const brought = await bring(maps);
        show(brought);
        if (asked === this.#asked) show([...(await bring(ERRORS)), ...brought]);
      }
    } catch (error) {
      show([], refusalIn(error).message);
    }
  }
}

/** What the browser's storage answers; refused (private windows, policies) or full it raises RequestError. */
async function stored<T>(ask: () => Promise<T>): Promise<T> {
  try {
    return await ask();
  } catch (error) {
    throw new RequestError({ title: `This browser keeps no frames: ${error}.` });
  }
}

function minus(a: Frame | null, b: Frame | null): Frame | null {
  if (a === null || b === null || a.shape.join() !== b.shape.join()) return null;
  const values = Float32Array.from(a.values);
  for (let at = 0; at < values.length; at++) values[at] -= b.values[at];
  return { ...a, origin: MADE, product: `${a.product}-difference`, values, map: summariseMap(values) };
}

/** A left of a column, and B from it on. */
export function wiped(a: Frame, b: Frame, column: number): Frame {
  if (a.shape.join() !== b.shape.join()) return a;
  const [values, columns] = [b.values.slice(), a.shape[1]];
  for (let row = 0; row < values.length; row += columns) values.set(a.values.subarray(row, row + column), row);
  return { ...a, origin: MADE, product: `${a.product}-wipe`, values };
}

/** Of the pixels whose difference has an error, the share that differ by more. */
export function beyondShare({ values }: Frame, errors: Float32Array): number {
  const known = errors.filter((error, at) => !Number.isNaN(error + values[at])).length;
  return errors.filter((error, at) => Math.abs(values[at]) > error).length / known;
}

const CONDITIONS = ["base_frequency_hz", "harmonics", "zeroth", "exposure_s", "takes", "calibration_id", "estimator"] as const;

/** What two frames were not measured or computed alike with, in words. */
export function differing(a: FrameMeta, b: FrameMeta): string[] {
  return CONDITIONS.filter((key) => a[key] !== b[key]).map((key) => key.replace(/_(hz|s|id)$/, "").replace("_", " "));
}
