import { useComputed } from "@preact/signals";
import { useMemo } from "preact/hooks";
import { deviation, engineering, fixed, NOTHING } from "../../scales/format";
import type { Frame } from "../../store/frames";
import type { Look } from "../../store/looks";
import { WINDOW } from "../../store/noise";
import type { Pixel } from "../../store/pixel";
import type { RangeErrors } from "../../store/rangeErrors";
import { useStore } from "../../store/store";
import { DISTRUST } from "../../ui/flags";
import "./Readout.css";

/** Value of a frame at a pixel; NaN without a frame, a pixel or a value. */
export function valueAtPixel(frame: Frame | null, pixel: Pixel | null): number {
  if (frame === null || pixel === null) return NaN;
  const [height, width] = frame.shape;
  return pixel.x < width && pixel.y < height ? frame.values[pixel.y * width + pixel.x] : NaN;
}

/** What the range of a pixel is worth: its error, and what that is made of or why not to trust it; null where that is not known. */
function rangeWorth(errors: RangeErrors, pixel: Pixel): { readonly error: string; readonly words: string } | null {
  const [trust, noise, bias] = [errors.at("trust", pixel), errors.at("range_std", pixel), errors.at("range_bias", pixel)];
  if (Number.isNaN(trust)) return null;
  const reason = DISTRUST.find(({ bit }) => bit === trust);
  const parts = `noise ${engineering(noise, "m", 2)}, bias ${engineering(bias, "m", 2)}`;
  return {
    error: deviation(errors.at("range_error", pixel), "m"),
    words: reason === undefined ? parts : `${parts}; not trusted: ${reason.words}`,
  };
}

/** The value under the pointer, how much it scatters, and how much light it rests on. */
export function Readout({ look: { product: shown, frame } }: { look: Look }) {
  const store = useStore();
  const ofLight = store.frames.amplitude.value;
  const amplitude = store.frames.of(ofLight);
  const [noise, lightNoise] = useMemo(() => [store.noises.of(shown.product), store.noises.of(ofLight)], [store, shown, ofLight]);
  const looked = useComputed(() => store.pointed.value ?? store.selected.value);
  const at = (width: number | undefined): number =>
    looked.value === null || width === undefined ? -1 : looked.value.y * width + looked.value.x;
  const place = useComputed(() => (looked.value === null ? "" : `${looked.value.x}, ${looked.value.y}`));
  const value = useComputed(() => fixed(valueAtPixel(frame.value, looked.value), shown.decimals, shown.unit));
  const scatter = useComputed(() => (noise.frames.value === 0 ? "" : deviation(noise.std(at(frame.value?.shape[1])), shown.unit)));
  const light = useComputed(() => fixed(valueAtPixel(amplitude.value, looked.value), 0, amplitude.value?.unit ?? ""));
  const lightScatter = useComputed(() =>
    lightNoise.frames.value === 0 ? "" : deviation(lightNoise.std(at(amplitude.value?.shape[1])), amplitude.value?.unit ?? ""),
  );
  const isRange = shown.product === "range";
  const worth = useComputed(() => (isRange && looked.value !== null ? rangeWorth(store.rangeErrors, looked.value) : null));
  const number = useComputed(() => frame.value?.meta.frame ?? "");
  if (place.value === "") return <p class="readout line quiet">Point at the picture to read it.</p>;
  return (
    <p class="readout line" data-frame={number} aria-live="off">
      <span>
        <output class="readout-value strong" data-field="value">
          {value}
        </output>{" "}
        {isRange ? (
          <span class="readout-value readout-error strong" data-field="error" title="Half of the 90 % interval of this pixel's range">
            {value.value === NOTHING ? "" : worth.value?.error}
          </span>
        ) : (
          <span
            class="quiet readout-scatter"
            data-field="scatter"
            title={`Standard deviation (1 σ) over the last ${WINDOW} frames, as measured at this pixel`}
          >
            {value.value === NOTHING ? "no value" : scatter}
          </span>
        )}
      </span>
      {shown.product !== ofLight && (
        <span>
          <span class="quiet">{ofLight}</span>{" "}
          <span class="readout-light" data-field="amplitude">
            {light}
          </span>{" "}
          <span class="quiet readout-scatter" data-field="amplitude-scatter">
            {lightScatter}
          </span>
        </span>
      )}
      <span class="quiet readout-pixel" data-field="pixel" title="Column and row of the pixel">
        {place}
      </span>
      {isRange && (
        <span class="quiet clipped readout-worth" data-field="worth" title={worth.value?.words}>
          {value.value === NOTHING ? "no value" : worth.value?.words}
        </span>
      )}
    </p>
  );
}
