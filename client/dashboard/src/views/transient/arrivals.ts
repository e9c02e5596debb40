/** When light arrives in the whole picture: mean densities at evenly spaced times over one period. */

import type { Lit } from "../../store/player";

/** Share of the brightest moment's light from which a moment is worth a picture, and of the brightest in light that is not interrupted. */
const LEAST = 0.05;
const LEAST_OF_RUN = 0.1;

/** At which times there is light: also of a weak return, but not to the end of a strong one's tail, which few pixels show. */
function worthOf(arrivals: ArrayLike<number>, ofRun = LEAST_OF_RUN): boolean[] {
  const all = Array.from(arrivals);
  const least = LEAST * Math.max(...all);
  const most = all.map((value) => (value > least ? value : 0));
  const spread = (to: number, from: number): number => (most[to] = most[to] && Math.max(most[to], most[from] ?? 0));
  for (const at of all.keys()) spread(at, at - 1);
  for (const at of [...all.keys()].reverse()) spread(at, at + 1);
  return all.map((value, at) => most[at] > 0 && value > ofRun * most[at]);
}

/** Turns, 0 to 1, evenly over the times at which light arrives and no others; over all times where none does. */
export function turnsOf(arrivals: ArrayLike<number>, count: number): number[] {
  const all = worthOf(arrivals);
  const worth = all.flatMap((lit, at) => (lit ? [at] : []));
  const times = worth.length > 0 ? worth : all.map((_, at) => at);
  return Array.from({ length: count }, (_, n) => {
    const place = ((n + 0.5) / count) * times.length;
    return (times[Math.floor(place)] + (place % 1)) / all.length;
  });
}

/** From when to when there is light, in shares of the period, with a little dark around it; null where there is none. */
export function litOf(arrivals: ArrayLike<number>): Lit | null {
  const worth = worthOf(arrivals, 0);
  if (!worth.includes(true)) return null;
  const room = 0.02;
  return {
    first: Math.max(0, worth.indexOf(true) / worth.length - room),
    last: Math.min(1, (worth.lastIndexOf(true) + 1) / worth.length + room),
  };
}

/** The parts of the period without light, in shares of it; none where there is no light at all. Light stays in sight for `trail` of it. */
export function gapsOf(arrivals: ArrayLike<number>, trail = 0): Lit[] {
  const worth = worthOf(arrivals).map((_, at, all) => all.slice(Math.max(0, at - Math.floor(trail * all.length)), at + 1).includes(true));
  const lit = worth.flatMap((is, at) => (is ? [at] : []));
  const after = [...lit, worth.length];
  // from a time with light to the next one without it there is light for half of the way
  const gaps = [-1, ...lit].map((at, n) => ({ first: Math.max(0, at + 0.5) / worth.length, last: after[n] / worth.length }));
  return lit.length === 0 ? [] : gaps.filter(({ first, last }) => (last - first) * worth.length > 0.75);
}

/** Ends that noise alone moves stay where they are. */
export function steady(before: Lit | null, now: Lit | null): Lit | null {
  const near = before !== null && now !== null && Math.abs(before.first - now.first) + Math.abs(before.last - now.last) < 0.03;
  return near ? before : now;
}

/** Share of the brightest moment's light from which a maximum counts, and how far it must stand out on either side. */
const LEAST_PEAK = 0.1;
const REACH = 4;

/** Turns, 0 to 1, at which most light arrives: the maxima of the curve, in their order. */
export function peaksOf(arrivals: ArrayLike<number>): number[] {
  const count = arrivals.length;
  const least = LEAST_PEAK * Math.max(...Array.from(arrivals));
  const at = (n: number): number => arrivals[(n + count) % count];
  const isPeak = (n: number): boolean => {
    for (let step = 1; step <= REACH; step++) if (at(n) <= at(n - step) || at(n) < at(n + step)) return false;
    return at(n) > least;
  };
  return Array.from({ length: count }, (_, n) => n)
    .filter(isPeak)
    .map((n) => n / count);
}
