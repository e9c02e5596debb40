import { useSignal } from "@preact/signals";

import { engineering } from "../../scales/format";
import { useStore } from "../../store/store";

/** The error that a plan predicts of each pixel, before it is captured, and the region that it is for. */
export function PlannedMap() {
  const pixels = useSignal("0 0 1 1");
  const { mapped, looked } = useStore().accuracy;
  if (mapped.value === null || looked.value !== mapped.value.plan) return null;
  const corners = mapped.value.plan.region;
  const target_m = mapped.value.plan.predicted.within?.target_m;
  const middle = target_m == null ? "bright the worst" : `the middle colour ${engineering(target_m, "m", 2)}`;
  return (
    <figure class="planned-map" data-field="planned_map">
      <div class="planned-picture">
        <img
          src={mapped.value.url}
          alt="Predicted error of each pixel"
          onLoad={({ currentTarget: { naturalWidth, naturalHeight } }) => (pixels.value = `0 0 ${naturalWidth} ${naturalHeight}`)}
        />
        {corners != null && (
          <svg class="cover mark-polygon" viewBox={pixels.value} aria-hidden="true">
            <polygon data-field="planned_region" points={corners.map(([x, y]) => `${x + 0.5},${y + 0.5}`).join(" ")} />
          </svg>
        )}
      </div>
      <figcaption class="quiet">Predicted error of each pixel: dark is 0, {middle}.{corners != null && " The plan is for the outlined region."}</figcaption>
    </figure>
  );
}
