import { type ReadonlySignal, useComputed } from "@preact/signals";
import { useRef } from "preact/hooks";
import { DEGREE } from "../../physics/constants";
import { tiltOf } from "../../physics/plane";
import { engineering, fixed, grouped } from "../../scales/format";
import { histogram } from "../../scales/scale";
import type { Look } from "../../store/looks";
import { figuresOf, type RegionFigures } from "../../store/measures";
import { useStore } from "../../store/store";
import { Remove } from "../../ui/controls";
import { useComputedOf, useDrawing } from "../../ui/hooks";
import { planeOf } from "../points/cloud";
import { lensOf } from "../points/lens";
import { PinsRow } from "./PinsRow";
import "./Measured.css";

const BINS = 64;
const HEIGHT_PX = 24;

/** What is measured by hand in the map: a region, and pins with their distances. */
export function Measured({ look }: { look: Look }) {
  const { measures } = useStore();
  return (
    <>
      {measures.region.value !== null && <RegionRow key={look.product.product} look={look} />}
      {measures.pins.value.length > 0 && <PinsRow look={look} />}
    </>
  );
}

/** Figures of the region's pixels on the map that is shown, and how often each value occurs. */
function RegionRow({ look }: { look: Look }) {
  const store = useStore();
  const { measures } = store;
  const { unit, decimals } = look.product;
  const figures = useComputedOf([look, measures], () => {
    const [frame, region] = [look.frame.value, measures.region.value];
    return frame === null || region === null ? null : figuresOf(frame.values, frame.shape[1], frame.shape[0], region);
  });
  const found = figures.value;
  const plane = useComputed(() => {
    const [frame, region] = [look.frame.value, measures.region.value];
    if (look.product.product !== "range" || frame === null || region === null) return null;
    const [height, width] = frame.shape;
    return planeOf(frame.values, width, height, region, lensOf(store, width, height));
  }).value;
  if (found === null) return null;
  return (
    <div class="panel-row wrapped measured" role="group" aria-label="Region">
      <span title="Mean over the pixels of the region">
        <span class="quiet">region</span> <span data-field="region-mean">{fixed(found.mean, decimals, unit)}</span>
      </span>
      <span title="Standard deviation over the pixels of the region: of noise and of shape">
        <span class="quiet">σ</span> <span data-field="region-std">{fixed(found.std, decimals, unit)}</span>
      </span>
      <span title="Pixels that have a value">
        <span class="quiet">N</span> <span data-field="region-count">{grouped(found.count)}</span>{" "}
        <span class="quiet">
          <span class="measured-more">of {grouped(found.pixels)}, </span>
          <span data-field="region-filled">{fixed((100 * found.count) / found.pixels, 0, "%")}</span>
        </span>
      </span>
      {plane !== null && (
        <span title="The plane that the points of the region are nearest to: standard deviation of their distances from it, and the angle between its normal and the camera's axis">
          <span class="quiet">plane σ</span> <span data-field="plane-residual">{engineering(plane.residual, "m", 2)}</span>{" "}
          <span class="quiet">tilt</span> <span data-field="plane-tilt">{fixed(tiltOf(plane) / DEGREE, 1, "°")}</span>
        </span>
      )}
      <RegionHistogram look={look} figures={figures} />
      <Remove what="Remove region" onClick={() => (measures.region.value = null)} />
    </div>
  );
}

/** How often each value occurs in the region, over the colour scale. */
function RegionHistogram({ look, figures }: { look: Look; figures: ReadonlySignal<RegionFigures | null> }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useDrawing(() => {
    const context = canvas.current?.getContext("2d");
    const values = figures.value?.values;
    if (!context || values === undefined) return;
    const counts = histogram(values, look.scale.value, BINS);
    const most = Math.max(1, ...counts);
    context.clearRect(0, 0, BINS, HEIGHT_PX);
    context.fillStyle = getComputedStyle(context.canvas).color;
    counts.forEach((count, bin) => context.fillRect(bin, HEIGHT_PX * (1 - count / most), 1, (HEIGHT_PX * count) / most));
  }, [look, figures]);
  return (
    <canvas
      ref={canvas}
      class="measured-histogram"
      width={BINS}
      height={HEIGHT_PX}
      role="img"
      aria-label="Histogram of the region over the colour scale"
    />
  );
}
