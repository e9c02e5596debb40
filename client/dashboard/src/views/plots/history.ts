/** Values of a map over the last seconds, at places that are looked at. */
import { statistics } from "../../physics/statistics";

/** How long values are kept. */
export const KEPT_S = 10;
/** Frames that are kept at most, whatever their rate. */
const MOST = 2000;

type Sample = Readonly<{ time_s: number; values: ReadonlyMap<string, number> }>;

/** What a series did over the time that is kept. */
export interface SeriesFigures {
  readonly last: number;
  readonly mean: number;
  /** Standard deviation over time, with N - 1; NaN below two values. */
  readonly std: number;
}

/** The last seconds of several series of numbers, by their names. */
export class History {
  #samples: Sample[] = [];

  /** Adds a frame's values; one of an earlier time, as of a recording that is wound back, begins anew. */
  take(time_s: number, values: ReadonlyMap<string, number>): void {
    const last_s = this.#samples.at(-1)?.time_s ?? -Infinity;
    if (time_s < last_s) this.#samples = [];
    else if (time_s === last_s) this.#samples.pop(); // the same frame, looked at elsewhere
    this.#samples.push({ time_s, values });
    const first = this.#samples.findIndex((sample) => sample.time_s >= time_s - KEPT_S);
    this.#samples = this.#samples.slice(Math.max(first, this.#samples.length - MOST));
  }

  /** Seconds before the newest frame, and each series' values at these; null where it had none. */
  series(names: readonly string[]): { readonly ago_s: number[]; readonly lines: (number | null)[][] } {
    const now_s = this.#samples.at(-1)?.time_s ?? 0;
    return {
      ago_s: this.#samples.map(({ time_s }) => time_s - now_s),
      lines: names.map((name) => this.#samples.map(({ values }) => finite(values.get(name)))),
    };
  }

  figures(name: string): SeriesFigures {
    const values = this.#samples.map((sample) => finite(sample.values.get(name))).filter((value) => value !== null);
    return { last: this.#samples.at(-1)?.values.get(name) ?? NaN, ...statistics(values) };
  }
}

function finite(value: number | undefined): number | null {
  return value !== undefined && Number.isFinite(value) ? value : null;
}
