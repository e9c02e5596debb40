/** The simulated world in words. */

import { significant } from "../../scales/format";
import type { Fault } from "../../store/simulation";
import type { EffectDocument, ExplanationDocument } from "../../stream/documents";

/** How faults are called on their buttons, and what they do. */
export const FAULTS: Readonly<Record<Fault, { readonly word: string; readonly title: string }>> = {
  unplug: { word: "Unplug", title: "Pull the cable of the camera" },
  replug: { word: "Plug in", title: "Plug the cable in again" },
  "corrupt-image": { word: "Spoil an image", title: "Damage the next image on the wire" },
  "drop-image": { word: "Lose an image", title: "Lose the next image on the wire" },
};

/** Whether a fault can happen now: what hangs on no cable cannot be unplugged. */
export function possible(fault: Fault, plugged: boolean): boolean {
  return fault === "replug" ? !plugged : plugged;
}

/** "lens-scatter" as "Lens scatter" */
export function effectWords(effect: string): string {
  const words = effect.replaceAll("-", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** The effect's size over the noise floor: "3.2×". */
export function sizeWords({ relative }: EffectDocument): string {
  return relative === 0 ? "0" : `${significant(relative, 2)}×`;
}

/** Length of a bar for a size, 0 to 1, logarithmic about what is called for. */
export function sizeShare({ relative }: EffectDocument, calledAbove: number): number {
  if (relative <= 0) return 0;
  const decades = Math.log10(relative / calledAbove);
  return Math.min(1, Math.max(0, 0.5 + decades / 4));
}

/** Light that the scene calls for, and that cannot be made. */
export function lacking(notMade: readonly EffectDocument[]): EffectDocument[] {
  return notMade.filter(({ called_for }) => called_for);
}

/** The largest first; what is built before what is not, and what cannot be made among that if it is called for. */
export function ordered({ effects, not_made }: ExplanationDocument): EffectDocument[] {
  return [...effects, ...lacking(not_made)].sort((a, b) => Number(b.built) - Number(a.built) || b.relative - a.relative);
}
