/** The returns of one pixel beside what is true, and how they scatter from look to look. */
import { statistics } from "../../physics/statistics";
import type { PixelDocument, ReturnDocument } from "../../stream/documents";
import { Looks } from "./looks";

/** Returns with less than this share of the light are listed together. */
const WEAK_SHARE = 0.02;
/** A return of a look before is the same one where it came within this time: 1 ns is 15 cm. */
const SAME_S = 1e-9;
/** The fewest looks that a deviation is computed from. */
const FEWEST = 5;

type Sifted = Readonly<{ strong: readonly ReturnDocument[]; weak: number; weakShare: number }>;

/** The returns that are worth a line, by time, and the light of the others together. */
export function sifted(returns: readonly ReturnDocument[]): Sifted {
  const light = returns.reduce((sum, { weight }) => sum + Math.max(0, weight), 0);
  const strong = returns.filter(({ weight }) => weight >= WEAK_SHARE * light).sort((a, b) => a.time_s - b.time_s);
  const rest = returns.filter((each) => !strong.includes(each));
  return { strong, weak: rest.length, weakShare: light > 0 ? rest.reduce((sum, { weight }) => sum + weight, 0) / light : 0 };
}

/** A line of the table: what was found, what is true, or both. */
export type ReturnLine = Readonly<{ found: ReturnDocument | null; truth: ReturnDocument | null }>;

/** Returns beside the true ones, by time. The two are the same one where each is the nearest to the other. */
export function linesOf(found: readonly ReturnDocument[], truth: readonly ReturnDocument[]): ReturnLine[] {
  const matched = found.map((each) => {
    const near = nearest(each, truth);
    return { found: each, truth: near !== null && nearest(near, found) === each ? near : null };
  });
  const missed = truth.filter((each) => !matched.some((line) => line.truth === each)).map((each) => ({ found: null, truth: each }));
  const time_s = ({ found: seen, truth: real }: ReturnLine): number => (seen ?? real)?.time_s ?? 0;
  return [...matched, ...missed].sort((a, b) => time_s(a) - time_s(b));
}

function nearest(each: ReturnDocument, others: readonly ReturnDocument[]): ReturnDocument | null {
  const distance = (other: ReturnDocument): number => Math.abs(other.time_s - each.time_s);
  return others.reduce<ReturnDocument | null>((best, other) => (best === null || distance(other) < distance(best) ? other : best), null);
}

/** The returns of one pixel over its last looks. */
export class ReturnHistory {
  readonly #looks = new Looks<readonly ReturnDocument[]>();

  /** Takes a look, once a frame; another pixel, sequence, calibration or scene begins anew. */
  take({ x, y, returns, meta }: Pick<PixelDocument, "x" | "y" | "returns" | "meta">, scene = ""): void {
    this.#looks.take([x, y, meta.sequence_id, meta.calibration_id, scene].join(), meta.frame, returns);
  }

  /** Standard deviations (1 σ) of a return over the last looks; NaN before there were enough. */
  of(found: ReturnDocument): Pick<ReturnDocument, "time_s" | "weight"> {
    const same = this.#looks.all.flatMap((look) => {
      const near = nearest(found, look);
      return near !== null && Math.abs(near.time_s - found.time_s) <= SAME_S ? [near] : [];
    });
    return { time_s: deviationOf(same.map(({ time_s }) => time_s)), weight: deviationOf(same.map(({ weight }) => weight)) };
  }
}

function deviationOf(values: readonly number[]): number {
  return values.length < FEWEST ? NaN : statistics(values).std;
}
