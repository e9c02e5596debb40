import { useComputed } from "@preact/signals";
import type { Backdrop } from "../../gl/renderer";
import type { Scale } from "../../scales/scale";
import { scaleOf } from "../../scales/tone";
import { drawnOf, type Frame } from "../../store/frames";
import type { Play, TransientLook } from "../../store/lightLook";
import { AMPLITUDE } from "../../store/mapCatalogue";
import { type Store, useStore } from "../../store/store";
import { ColourBar } from "../../ui/ColourBar";

/** What the colours of the light mean: their scale and its unit. */
export function lightScale(look: TransientLook, store: Store, play: Play): { readonly scale: Scale; readonly unit: string } {
  const gathered = play !== "density";
  const white = gathered ? (store.frames.of(AMPLITUDE).value?.map?.high ?? NaN) / 2 ** look.stops.value : look.white.value * 1e-9;
  return { scale: scaleOf(look.tone.value, Number(white.toPrecision(3))), unit: gathered ? "DN" : "DN/ns" };
}

/** The colour bar of light in flight, or of light gathered over a time. */
export function LightBar({ look, play }: { look: TransientLook; play: Play }) {
  const store = useStore();
  const dark = useComputed(() => store.frames.of("coefficients").value === null).value;
  const { scale, unit } = lightScale(look, store, play);
  return !dark && scale.high > 0 ? (
    <ColourBar scale={scale} colours={look.colours.value} unit={unit} />
  ) : (
    <div class="colour-bar colour-bar-bare" />
  );
}

/** The still scene behind the light, where it is wanted. */
export function backdropOf(amplitude: Frame | null, light: TransientLook): Backdrop | null {
  const white = amplitude?.map?.high ?? NaN;
  return light.backdrop.value && white > 0 && amplitude?.values instanceof Float32Array
    ? { values: drawnOf(amplitude) as Float32Array, white }
    : null;
}
