import uPlot from "uplot";

import { rangeOfTime_m } from "../../physics/constants";
import { grouped, significant, withUnit } from "../../scales/format";
import { powersBetween, ticks } from "../../scales/scale";
import { PIN_COLOURS, PIN_NAMES } from "../../store/measures";
import { inkOf, plain } from "../plots/page";
import { type Curves, ESTIMATES, type PinLines } from "./curves";
import type { Aspect } from "./sides";
import { drawStems, NO_STEMS, type Stems } from "./stems";

/** The plot, and the line that marks the player's time in it. */
export interface ResponsePlot {
  readonly plot: uPlot;
  readonly head: HTMLElement;
  /** Shows curves of the aspect that the plot was made for, the returns, and the estimates of pins at the same times. */
  show(curves: Curves | null, stems: Stems, pins: PinLines): void;
}

export interface PlotOptions {
  readonly aspect: Aspect;
  readonly logarithmic: boolean;
  /** Upper end of the density's axis. */
  readonly top: () => number;
  /** Both ends of the axis of time, before there is data too. */
  readonly ends_ns: () => [number, number];
  /** Called with the time that was clicked. */
  readonly seek: (time_ns: number) => void;
  /** Called with the sample under the pointer; null when it leaves. */
  readonly point: (sample: { readonly time_ns: number; readonly value: number } | null) => void;
}

/** A plot of light over time of flight in ns, with the range it stands for on top. */
export function responsePlot(box: HTMLElement, { aspect, logarithmic, top, ends_ns, seek, point }: PlotOptions): ResponsePlot {
  const { ink, axis } = inkOf(box);
  const [line, wash, truthInk] = ["--curve", "--curve-wash", "--truth"].map(ink);
  let stems = NO_STEMS;
  const solid = { stroke: line, width: 1.5, points: { show: false } };
  const edge = { ...solid, width: 0.75 };
  const true_ = { ...solid, stroke: truthInk, width: 1.25, dash: [5, 4] };
  const series: Record<Aspect, uPlot.Series[]> = {
    density: [{ ...solid, fill: wash }],
    bounds: [edge, edge, solid, true_],
    cumulative: [{ ...solid, fill: wash }, true_],
  };
  const ofPins = PIN_NAMES.map((name): uPlot.Series => ({ ...solid, stroke: PIN_COLOURS[name], width: 1.25 }));
  // What the hover line reads: the estimate itself.
  const main = ESTIMATES[aspect] + 1;
  const empty = (): uPlot.AlignedData => [[], ...[...series[aspect], ...ofPins].map(() => [])];
  const plot = new uPlot(
    {
      ...plain(box),
      padding: [0, 12, 0, 0],
      hooks: {
        setCursor: [
          ({ cursor: { idx }, data }) => {
            const value = idx == null ? null : data[main]?.[idx];
            point(idx == null || value == null ? null : { time_ns: data[0][idx], value });
          },
        ],
        draw: [(drawn) => drawStems(drawn, stems, { found: line, truth: truthInk })],
      },
      scales: {
        x: { time: false, range: ends_ns },
        y: logarithmic
          ? { distr: 3, range: () => [10 ** (decade(top()) - LOG_DECADES), top()] }
          : aspect !== "cumulative"
            ? { distr: 4, range: () => [0, top()] }
            : { range: () => [0, top()] },
      },
      axes: [
        {
          ...axis,
          size: 20,
          gap: 2,
          values: (_plot, splits) => splits.map((time_ns, at) => withUnit(String(time_ns), at === splits.length - 1 ? "ns" : "")),
        },
        {
          ...axis,
          size: 52,
          gap: 4,
          label: aspect === "cumulative" ? "DN" : "DN/ns",
          labelSize: 16,
          labelGap: 0,
          space: 28,
          values: (_plot, splits) => splits.map(tickText),
          ...(logarithmic
            ? { splits: powersOfTen, filter: all }
            : aspect !== "cumulative"
              ? { splits: bentSplits(ASINH_SHARES[aspect]), filter: all }
              : {}),
        },
        {
          ...axis,
          scale: "x",
          side: 0,
          size: 24,
          gap: 2,
          grid: { show: false },
          // Round numbers of metres, placed at the times they stand for.
          splits: ({ width }, _axis, low, high) => metres(low, high, width).map((range_m) => range_m / METRES_PER_NS),
          values: (_plot, splits) => splits.map((time_ns) => `${Number((time_ns * METRES_PER_NS).toFixed(2))}\u202fm`),
        },
      ],
      series: [{}, ...series[aspect], ...ofPins],
      bands: aspect === "bounds" ? [{ series: [2, 1], fill: wash }] : [],
    },
    empty(),
    box,
  );
  plot.over.addEventListener("click", () => {
    const left = plot.cursor.left ?? -1;
    if (left >= 0) seek(plot.posToVal(left, "x"));
  });
  const head = document.createElement("i");
  head.className = "response-head playhead";
  plot.over.append(head);
  return {
    plot,
    head,
    show: (curves, stemsNow, pins) => {
      stems = stemsNow;
      // Where the axis bends; it follows the axis, and uPlot takes it from here.
      Object.assign(plot.scales.y, { asinh: top() / ASINH_SHARES[aspect] });
      if (curves === null) plot.setData(empty());
      else plot.setData([curves.time_ns, ...curves.lines, ...PIN_NAMES.map((name) => pins.get(name) ?? curves.time_ns.map(() => NaN))]);
    },
  };
}

/** The axis over the height from which heights grow by factors instead of by steps: a narrow peak leaves the rest in sight, and what is smoothed has none so narrow. */
const ASINH_SHARES: Readonly<Record<Aspect, number>> = { density: 1000, bounds: 20, cumulative: 1 };

/** Decades that the logarithmic axis shows. */
const LOG_DECADES = 5;

function decade(value: number): number {
  return Math.floor(Math.log10(value) + 1e-9);
}

function powersOfTen(_plot: uPlot, _axis: number, low: number, high: number): number[] {
  return powersBetween(low, high, [1]);
}

const all = (_plot: uPlot, splits: number[]): number[] => splits;

/** Least room of a number on a bent axis: in shares of its height, and in pixels. */
const BENT_ROOM = 0.1;
const BENT_ROOM_PX = 20;

/** Round numbers of an axis that bends at its end over `share`, as close as they can be read. */
function bentSplits(share: number): (plot: uPlot, axis: number, low: number, high: number) => number[] {
  return (plot, _axis, _low, high) => {
    const room = Math.max(BENT_ROOM, (BENT_ROOM_PX * uPlot.pxRatio) / plot.bbox.height);
    const place = (value: number): number => Math.asinh((share * value) / high) / Math.asinh(share);
    const kept = [0];
    for (const value of powersBetween(10 ** decade(high / share), high, [1, 2, 5])) {
      if (place(value) - place(kept[kept.length - 1]) >= room) kept.push(value);
    }
    return kept;
  };
}

function tickText(value: number): string {
  if (value >= 1) return value < 10 ? String(Number(value.toFixed(1))) : grouped(value);
  return significant(value, 1);
}

const METRES_PER_NS = rangeOfTime_m(1e-9);

function metres(low_ns: number, high_ns: number, width_px: number): number[] {
  return ticks({ low: low_ns * METRES_PER_NS, high: high_ns * METRES_PER_NS, kind: "linear" }, Math.min(9, width_px / 40));
}
