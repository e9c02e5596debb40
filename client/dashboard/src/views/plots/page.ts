/** What all plots of the page have in common: its ink and type, and the place that they fill. */
import { useSignal } from "@preact/signals";
import type { RefObject } from "preact";
import { useEffect } from "preact/hooks";
import type uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { useDrawing, useSize } from "../../ui/hooks";
import { PLOTS } from "../../ui/plotFiles";
import "./page.css";

/** The colours of the page where a plot stands, by their custom properties, and how its axes are drawn. */
export function inkOf(box: HTMLElement): { readonly ink: (name: string) => string; readonly axis: uPlot.Axis } {
  // Of a custom property only the text is known, and not which of its two colours holds here.
  const ink = (name: string): string => {
    box.style.color = `var(${name})`;
    const { color } = getComputedStyle(box);
    box.style.color = "";
    return color;
  };
  const style = getComputedStyle(box);
  const font = `${style.getPropertyValue("--small")} ${style.fontFamily}`;
  const line = { stroke: ink("--hairline"), width: 1 };
  return { ink, axis: { stroke: ink("--quiet"), font, labelFont: font, grid: line, ticks: { ...line, size: 4 } } };
}

/** A plot that fills its box from the start; neither dragged nor with a legend. */
export function plain(box: HTMLElement): Pick<uPlot.Options, "width" | "height" | "legend" | "cursor"> {
  return {
    width: Math.max(1, box.clientWidth),
    height: Math.max(1, box.clientHeight),
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, y: false, points: { size: 6 } },
  };
}

/** A plot in a box, as large as that, made anew when an input changes; null before and between. */
export function usePlot<T extends { readonly plot: uPlot }>(
  box: RefObject<HTMLElement | null>,
  make: (box: HTMLElement) => T,
  inputs: readonly unknown[],
) {
  const size = useSize(box);
  const made = useSignal<T | null>(null);
  useEffect(() => {
    if (box.current === null) return undefined;
    const now = make(box.current);
    PLOTS.set(now.plot.root, now.plot);
    made.value = now;
    return () => {
      made.value = null;
      now.plot.destroy();
    };
  }, inputs);
  useDrawing(() => {
    const { width, height } = size.value;
    if (width > 0 && height > 0) made.value?.plot.setSize({ width, height });
  }, [made, size]);
  return { made, size };
}
