import { type ReadonlySignal, signal, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { useStore } from "../../store/store";
import { useDrawing, useSize } from "../../ui/hooks";

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
  const size = useMemo(() => signal({ width: 0, height: 0 }), []);
  useSize(box, size);
  const plot = useSignal<uPlot | null>(null);
  const form = JSON.stringify([lines, along, across, ends, theme.dark.value]);
  useEffect(() => {
    if (box.current === null) return undefined;
    const made = makePlot(box.current, { lines, along, across, ends });
    plot.value = made;
    return () => {
      plot.value = null;
      made.destroy();
    };
  }, [form, plot]);
  useDrawing(() => {
    const { width, height } = size.value;
    if (width > 0 && height > 0) plot.value?.setSize({ width, height });
  }, [plot, size]);
  useDrawing(() => {
    // Between a change of the lines and the next plot the data may be of other lines.
    if (plot.value !== null && data.value.length === plot.value.series.length) plot.value.setData(data.value);
  }, [plot, data]);
  return <div class="line-chart" ref={box} role="img" aria-label={label} />;
}

function makePlot(
  box: HTMLElement,
  { lines, along, across, ends }: Pick<LineChartProps, "lines" | "along" | "across"> & { ends: LineChartProps["ends"] | undefined },
): uPlot {
  const style = getComputedStyle(box);
  const ink = (colour: string): string => (colour.startsWith("--") ? style.getPropertyValue(colour) : colour);
  const font = `${style.getPropertyValue("--small")} ${style.fontFamily}`;
  const axis = {
    stroke: ink("--quiet"),
    font,
    labelFont: font,
    grid: { stroke: ink("--hairline"), width: 1 },
    ticks: { stroke: ink("--hairline"), width: 1, size: 4 },
  };
  return new uPlot(
    {
      width: Math.max(1, box.clientWidth),
      height: Math.max(1, box.clientHeight),
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, y: false, points: { size: 6 } },
      padding: [8, 12, 0, 0],
      scales: { x: { time: false, ...(ends === undefined ? {} : { range: [...ends] as [number, number] }) } },
      axes: [
        { ...axis, size: 20, gap: 2, label: along, labelSize: 16, labelGap: 0 },
        { ...axis, size: 60, gap: 4, label: across, labelSize: 16, labelGap: 0, space: 28 },
      ],
      series: [{}, ...lines.map(({ name, colour }) => ({ label: name, stroke: ink(colour), width: 1.5, spanGaps: false }))],
    },
    [[], ...lines.map(() => [])],
    box,
  );
}
