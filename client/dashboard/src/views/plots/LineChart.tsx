import type { ReadonlySignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import uPlot from "uplot";

import { useStore } from "../../store/store";
import { useDrawing } from "../../ui/hooks";
import { inkOf, plain, usePlot } from "./page";

export interface Line {
  readonly name: string;
  /** In CSS; a custom property of the page by its name. */
  readonly colour: string;
}

interface LineChartProps {
  readonly label: string;
  readonly lines: readonly Line[];
  readonly along: string;
  readonly across: string;
  /** Ends of the axis along; the data's where it is absent. */
  readonly ends?: readonly [number, number];
  /** The axis along, and the values of each line. */
  readonly data: ReadonlySignal<uPlot.AlignedData>;
}

/** Some lines over one axis, in the colours of the page; made anew when the lines or the theme change. */
export function LineChart({ label, lines, along, across, ends, data }: LineChartProps) {
  const { theme } = useStore();
  const box = useRef<HTMLDivElement>(null);
  const form = JSON.stringify([lines, along, across, ends, theme.dark.value]);
  const { made } = usePlot(box, (place) => ({ plot: makePlot(place, { lines, along, across, ends }) }), [form]);
  useDrawing(() => {
    const plot = made.value?.plot;
    // Between a change of the lines and the next plot the data may be of other lines.
    if (data.value.length === plot?.series.length) plot.setData(data.value);
  }, [made, data]);
  return <div class="line-chart grow" ref={box} role="img" aria-label={label} />;
}

function makePlot(
  box: HTMLElement,
  { lines, along, across, ends }: Pick<LineChartProps, "lines" | "along" | "across"> & { ends: LineChartProps["ends"] | undefined },
): uPlot {
  const { ink, axis } = inkOf(box);
  return new uPlot(
    {
      ...plain(box),
      padding: [8, 12, 0, 0],
      scales: { x: { time: false, ...(ends === undefined ? {} : { range: [...ends] as [number, number] }) } },
      axes: [
        { ...axis, size: 20, gap: 2, label: along, labelSize: 16, labelGap: 0 },
        { ...axis, size: 60, gap: 4, label: across, labelSize: 16, labelGap: 0, space: 28 },
      ],
      series: [
        {},
        ...lines.map(({ name, colour }) => ({ label: name, stroke: colour.startsWith("--") ? ink(colour) : colour, width: 1.5 })),
      ],
    },
    [[], ...lines.map(() => [])],
    box,
  );
}
