import type { Signal } from "@preact/signals";
import type uPlot from "uplot";

import type { Look } from "../../store/looks";
import { useStore } from "../../store/store";
import { useComputedOf, useDrawing } from "../../ui/hooks";
import { LineChart } from "./LineChart";
import { profileOf } from "./profile";

/** The map along the line from pin A to pin B. */
export function AlongLine({ look, data }: { look: Look; data: Signal<uPlot.AlignedData> }) {
  const { measures } = useStore();
  const ends = useComputedOf([measures], () => (["A", "B"] as const).map((name) => measures.pins.value.find((pin) => pin.name === name)));
  useDrawing(() => {
    const [frame, [from, to]] = [look.frame.value, ends.value];
    if (frame === null || from === undefined || to === undefined) return;
    const { distance_px, values } = profileOf(frame.values, frame.shape[1], from, to);
    data.value = [distance_px, values];
  }, [look, ends]);
  const { name, unit } = look.product;
  if (ends.value.includes(undefined))
    return <p class="stage-empty">Pin two pixels, A and B, with Shift and a click: their line is shown here.</p>;
  return (
    <LineChart
      label={`${name} along the line from A to B`}
      lines={[{ name, colour: "--curve" }]}
      along="pixels from A to B"
      across={unit}
      data={data}
    />
  );
}
