import { signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type uPlot from "uplot";

import { oneOf, type Setting } from "../../store/settings";
import { useStore } from "../../store/store";
import { Tabs } from "../../ui/controls";
import { save } from "../../ui/download";
import { useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { AlongLine } from "./AlongLine";
import { KEPT_S } from "./history";
import { OverTime } from "./OverTime";
import "./PlotsView.css";

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
  const { product, name } = look.product;
  useProducts([product]);
  const key = `${product} ${side.value}`;
  const data = useMemo(() => signal<uPlot.AlignedData>([[]]), [key]);
  const csv = (): void => {
    const [along, ...lines] = data.peek();
    const head = [side.peek() === "time" ? "time_s" : "distance_px", ...lines.map((_, n) => `value_${n + 1}`)];
    const rows = [head, ...[...along].map((at, n) => [at, ...lines.map((line) => line[n] ?? "")])];
    save(`${product}-${side.peek()}.csv`, new Blob([rows.map((row) => `${row.join(",")}\n`).join("")], { type: "text/csv" }));
  };
  return (
    <Panel
      name="plots"
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
