/** What plots are saved as; what draws them is loaded then. */
import type uPlot from "uplot";
import type { Action } from "./ActionMenu";
import type { PlotWords } from "./drawing";

/** Plots that can be saved, by their elements. */
export const PLOTS = new WeakMap<Element, uPlot>();

/** The plot of a panel as files. */
export function plotFiles(panel: string, words: () => PlotWords): Action[] {
  const run = (kind: "png" | "svg") => async (): Promise<void> => {
    const { savePlot } = await import("./drawing");
    const drawn = document.querySelector(`.panel-${panel} .uplot`);
    const plot = drawn === null ? undefined : PLOTS.get(drawn);
    if (plot !== undefined) savePlot(plot, words(), kind);
  };
  return [
    { text: "Figure (PNG)", run: run("png") },
    { text: "Figure (SVG)", run: run("svg") },
  ];
}
