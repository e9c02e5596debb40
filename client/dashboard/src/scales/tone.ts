/**
 * Tone: how a density becomes a place on the colour map.
 *
 * A density has a far greater range than a screen: its peaks are narrow and high. `white` is the density
 * that is shown as the brightest colour.
 */

import type { Scale } from "./scale";

export type ToneKind = "linear" | "root" | "logarithmic";

export const TONES: readonly ToneKind[] = ["linear", "root", "logarithmic"];

export interface Tone {
  readonly kind: ToneKind;
  /** Density shown brightest, in units of b_0 per second. */
  readonly white: number;
}

/** Decades below white that the logarithmic tone shows. */
export const DECADES = 3;

/** Number of the tone in the shader. */
export function toneIndex(kind: ToneKind): number {
  return TONES.indexOf(kind);
}

/** Place of a density between dark (0) and white (1). The shader computes the same. */
export function toned(kind: ToneKind, share: number): number {
  const bounded = Math.min(1, Math.max(0, share));
  if (kind === "linear") return bounded;
  if (kind === "root") return Math.sqrt(bounded);
  return bounded > 0 ? Math.max(0, 1 + Math.log10(bounded) / DECADES) : 0;
}

/** Place on the colour map from which light over a still scene has its full colour. */
export const FULL_LIGHT = 0.18;

/** The tone as a scale that a colour bar can show, in units of `white`. */
export function scaleOf(kind: ToneKind, white: number): Scale {
  return { low: kind === "logarithmic" ? white / 10 ** DECADES : 0, high: white, kind };
}

/** Share of its colour that light at `place` adds to the still scene behind it: GLSL's smoothstep. */
export function strength(place: number): number {
  const x = Math.min(1, Math.max(0, place / FULL_LIGHT));
  return x * x * (3 - 2 * x);
}

/** Brightest grey of the still scene behind the light. */
export const BACKDROP_GAIN = 0.3;

/** Grey of the still scene, 0 to 1, where `share` is its brightness over white; the root brings out what is dim. */
export function backdropGrey(share: number): number {
  return share > 0 ? BACKDROP_GAIN * Math.sqrt(Math.min(1, share)) : 0;
}
