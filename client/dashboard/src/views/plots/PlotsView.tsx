import { type Signal, signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type uPlot from "uplot";
import { oneOf, type Setting } from "../../store/settings";
import { type Store, useStore } from "../../store/store";
import { Tabs } from "../../ui/controls";
import { saveTable } from "../../ui/download";
import type { PlotWords } from "../../ui/drawing";
import { captionOf } from "../../ui/figure";
import { useComputedOf, useDrawing, useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { History, KEPT_S } from "./history";
import "./PlotsView.css";
import { deviation, fixed } from "../../scales/format";
import type { Frame } from "../../store/frames";
import type { Look } from "../../store/looks";
import { figuresOf, PIN_COLOURS } from "../../store/measures";
import { type Pixel, pixelText } from "../../store/pixel";
import { valueAtPixel } from "../map/Readout";
import { type Line, LineChart } from "./LineChart";
import { profileOf } from "./profile";

type Side = "time" | "line";
const SIDES: readonly { readonly value: Side; readonly text: string; readonly hint: string }[] = [
  { value: "time", text: `Last ${KEPT_S} s`, hint: "The selected pixel, the pins and the mean of the region over time" },
  { value: "line", text: "Line A to B", hint: "Along the line from pin A to pin B" },
];

const SIDE: Setting<Side> = { key: "plots.side", initial: "time", ...oneOf(SIDES.map(({ value }) => value)) };

/** Values of the map that is shown: over the last seconds, or along a line. */
export function PlotsView() {
  const store = useStore();
  const side = store.settings.of(SIDE);
  const look = store.looks.of(store.mapProduct.value);
  const { product, name, unit } = look.product;
  useProducts([product]);
  const key = `${product} ${side.value}`;
  const data = useMemo(() => signal<uPlot.AlignedData>([[]]), [key]);
  const csv = (): void => {
    const [along, ...lines] = data.peek();
    const names = side.peek() === "time" ? placesOf(store).map((place) => place.name.replace(", ", "_")) : [name];
    const head = [side.peek() === "time" ? "time_s" : "distance_px", ...names.map((each) => `${product}_${each}_${unit}`.toLowerCase())];
    saveTable(words().name, [head, ...[...along].map((at, n) => [at, ...lines.map((line) => line[n])])]);
  };
  const words = (): PlotWords => {
    const meta = look.frame.peek()?.meta;
    const title = `${name} ${side.peek() === "time" ? `over the last ${KEPT_S} s` : "along the line from A to B"}`;
    return { name: `${product}-${side.peek()}`, title, caption: meta ? captionOf(meta, store.sequence.peek()) : "" };
  };
  return (
    <Panel
      plot={words}
      title={
        <h2>
          Values <span class="quiet">of {name.toLowerCase()}</span>
        </h2>
      }
      tools={<Tabs label="What of the values" value={side.value} options={SIDES} onChange={(value) => (side.value = value)} />}
      downloads={[{ text: "Values (CSV)", run: csv }]}
    >
      <div class="plots column grow spaced">
        {side.value === "time" ? <OverTime key={key} look={look} data={data} /> : <AlongLine key={key} look={look} data={data} />}
      </div>
    </Panel>
  );
}

/** The map along the line from pin A to pin B. */
function AlongLine({ look, data }: { look: Look; data: Signal<uPlot.AlignedData> }) {
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
    return <p class="stage-empty cover">Pin two pixels, A and B, with Shift and a click: their line is shown here.</p>;
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

/** A place whose value is followed; its key says where it lies, so that another place under the same name begins anew. */
interface Place extends Line {
  readonly key: string;
  readonly valueIn: (frame: Frame) => number;
}

/** The selected pixel, the pins and the mean of the region over the last seconds. */
function OverTime({ look, data }: { look: Look; data: Signal<uPlot.AlignedData> }) {
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
