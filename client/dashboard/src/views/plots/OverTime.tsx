import { type Signal, signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type uPlot from "uplot";
import { deviation, fixed } from "../../scales/format";
import type { Frame } from "../../store/frames";
import type { Look } from "../../store/looks";
import { figuresOf, PIN_COLOURS } from "../../store/measures";
import { type Pixel, pixelText } from "../../store/pixel";
import { type Store, useStore } from "../../store/store";
import { useComputedOf, useDrawing } from "../../ui/hooks";
import { valueAtPixel } from "../map/Readout";
import { History, KEPT_S } from "./history";
import { type Line, LineChart } from "./LineChart";

/** A place whose value is followed; its key says where it lies, so that another place under the same name begins anew. */
interface Place extends Line {
  readonly key: string;
  readonly valueIn: (frame: Frame) => number;
}

/** The selected pixel, the pins and the mean of the region over the last seconds. */
export function OverTime({ look, data }: { look: Look; data: Signal<uPlot.AlignedData> }) {
  const store = useStore();
  const history = useMemo(() => new History(), []);
  const places = useComputedOf([store], () => placesOf(store));
  const taken = useMemo(() => signal(0), []);
  useDrawing(() => {
    const frame = look.frame.value;
    if (frame === null) return;
    history.take(frame.meta.device_time_s, new Map(places.value.map(({ key, valueIn }) => [key, valueIn(frame)])));
    const { ago_s, lines } = history.series(places.value.map(({ key }) => key));
    data.value = [ago_s, ...lines];
    taken.value = frame.meta.frame;
  }, [look, history, places]);
  const { unit, decimals, name } = look.product;
  void taken.value; // the figures below are of this frame
  return (
    <>
      <LineChart
        label={`${name} over the last ${KEPT_S} s`}
        lines={places.value.map(({ name: of, colour }) => ({ name: of, colour }))}
        along="time (s)"
        across={unit}
        ends={[-KEPT_S, 0]}
        data={data}
      />
      <p class="key wrapped">
        {places.value.map(({ key, name: of, colour }) => {
          const { last, mean, std } = history.figures(key);
          return (
            <span key={key} class="plots-place" style={{ "--line": colour.startsWith("--") ? `var(${colour})` : colour }} data-place={of}>
              {of} {fixed(last, decimals, unit)}{" "}
              <span class="quiet" title="Mean and standard deviation (1 σ) over the time that is shown">
                mean {fixed(mean, decimals)} {deviation(std, unit)}
              </span>
            </span>
          );
        })}
        {places.value.length === 0 && "Click a pixel, pin one with Shift and a click, or mark a region with Shift and dragging."}
      </p>
    </>
  );
}

function placesOf({ selected, measures }: Store): Place[] {
  const [pixel, region] = [selected.value, measures.region.value];
  const at = (place: Pixel, name: string, colour: string): Place => ({
    key: `${name} ${pixelText(place)}`,
    name,
    colour,
    valueIn: (frame) => valueAtPixel(frame, place),
  });
  const places = measures.pins.value.map((pin) => at(pin, pin.name, PIN_COLOURS[pin.name]));
  if (pixel !== null) places.unshift(at(pixel, `${pixel.x}, ${pixel.y}`, "--curve"));
  if (region !== null) {
    const valueIn = ({ values, shape }: Frame): number => figuresOf(values, shape[1], shape[0], region).mean;
    places.push({ key: `region ${JSON.stringify(region)}`, name: "region", colour: "--light", valueIn });
  }
  return places;
}
