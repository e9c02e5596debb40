import { engineering } from "../../scales/format";
import { useStore } from "../../store/store";

/** The error that a plan predicts of each pixel, before it is captured. */
export function PlannedMap() {
  const { mapped, looked } = useStore().accuracy;
  if (mapped.value === null || looked.value !== mapped.value.plan) return null;
  const target_m = mapped.value.plan.predicted.within?.target_m;
  const middle = target_m == null ? "bright the worst" : `the middle colour ${engineering(target_m, "m", 2)}`;
  return (
    <figure class="planned-map" data-field="planned_map">
      <img src={mapped.value.url} alt="Predicted error of each pixel" />
      <figcaption class="small quiet">Predicted error of each pixel: dark is 0, {middle}.</figcaption>
    </figure>
  );
}
