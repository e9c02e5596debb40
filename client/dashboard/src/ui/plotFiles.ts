/** What plots are saved as; what draws them is loaded then. */
import type uPlot from "uplot";
import type { Action } from "./ActionMenu";
import type { PlotWords } from "./drawing";
import { figures } from "./figure";

/** Plots that can be saved, by their elements. */
export const PLOTS = new WeakMap<Element, uPlot>();

/** The plot of a panel as files. */
export function plotFiles(panel: string, words: () => PlotWords): Action[] {
  return figures((kind) => async (): Promise<void> => {
    const { savePlot } = await import("./drawing");
    const drawn = document.querySelector(`.panel-${panel} :is(.uplot, svg.plot)`);
    if (drawn !== null) savePlot(drawn, PLOTS.get(drawn), words(), kind);
  });
}
