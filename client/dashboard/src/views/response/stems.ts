import type uPlot from "uplot";

import type { PixelDocument } from "../../stream/documents";
import type { Truth } from "./curves";
import { type ReturnHistory, sifted } from "./returns";

/** A return in the plot. */
interface Stem {
  readonly time_s: number;
  /** Standard deviation of that time over the last looks (1 σ); NaN where it is not known. */
  readonly std_s: number;
  /** Its share of the pixel's light: how high it stands. */
  readonly share: number;
}

/** The returns that were found and those that are true. */
export type Stems = Readonly<{ found: readonly Stem[]; truth: readonly Stem[] }>;

export const NO_STEMS: Stems = { found: [], truth: [] };

/** The returns of a pixel that have a line in its table. */
export function stemsOf(details: Pick<PixelDocument, "returns">, truth: Truth | null, history: ReturnHistory): Stems {
  const light = details.returns.reduce((sum, { weight }) => sum + Math.max(0, weight), 0);
  const { strong } = sifted(details.returns);
  return {
    found: strong.map((each) => ({ time_s: each.time_s, std_s: history.of(each).time_s, share: each.weight / light })),
    truth: (truth?.returns ?? []).map(({ time_s, weight }) => ({ time_s, std_s: NaN, share: weight / (truth?.brightness ?? NaN) })),
  };
}

const WIDTH_PX = 2;
const TRUTH_WIDTH_PX = 4;
const CAP_PX = 5;

/** Draws returns as stems from the foot of the plot, found ones over the true ones and with ± 1 σ of their time. */
export function drawStems(plot: uPlot, { found, truth }: Stems, ink: { readonly found: string; readonly truth: string }): void {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, 0, bbox.width, ctx.canvas.height);
  ctx.clip(); // the plot may show a part of the period
  ctx.setLineDash([]);
  ctx.strokeStyle = ink.truth;
  ctx.lineWidth = TRUTH_WIDTH_PX * devicePixelRatio;
  for (const stem of truth) drawStem(plot, stem);
  [ctx.strokeStyle, ctx.fillStyle] = [ink.found, ink.found];
  ctx.lineWidth = WIDTH_PX * devicePixelRatio;
  for (const stem of found) {
    drawStem(plot, stem);
    if (Number.isFinite(stem.std_s)) drawDeviation(plot, stem);
  }
  ctx.restore();
}

function heightOf({ bbox }: uPlot, { share }: Stem): number {
  return bbox.top + bbox.height * (1 - Math.min(1, share));
}

function xOf(plot: uPlot, time_s: number): number {
  return plot.valToPos(time_s * 1e9, "x", true);
}

function drawStem(plot: uPlot, stem: Stem): void {
  const x = xOf(plot, stem.time_s);
  plot.ctx.beginPath();
  plot.ctx.moveTo(x, plot.bbox.top + plot.bbox.height);
  plot.ctx.lineTo(x, heightOf(plot, stem));
  plot.ctx.stroke();
}

/** A bar across the head of a stem, with caps at its ends. */
function drawDeviation(plot: uPlot, stem: Stem): void {
  const [from, to, y] = [xOf(plot, stem.time_s - stem.std_s), xOf(plot, stem.time_s + stem.std_s), heightOf(plot, stem)];
  const cap = CAP_PX * devicePixelRatio;
  plot.ctx.beginPath();
  plot.ctx.moveTo(from, y);
  plot.ctx.lineTo(to, y);
  for (const end of [from, to]) {
    plot.ctx.moveTo(end, y - cap);
    plot.ctx.lineTo(end, y + cap);
  }
  plot.ctx.stroke();
}
