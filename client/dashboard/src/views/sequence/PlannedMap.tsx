import { useRef } from "preact/hooks";
import { engineering } from "../../scales/format";
import { regionOf } from "../../store/measures";
import type { Pixel } from "../../store/pixel";
import { useStore } from "../../store/store";
import "./PlannedMap.css";

/** The error that a plan predicts of each pixel, before it is captured; a box drawn in it is the region of the next plan. */
export function PlannedMap() {
  const { accuracy, measures, camera } = useStore();
  const begun = useRef<Pixel | null>(null);
  const mapped = accuracy.mapped.value;
  const { width, height } = camera.value?.capabilities ?? {};
  if (mapped === null || accuracy.looked.value !== mapped.plan) return null;
  if (typeof width !== "number" || typeof height !== "number") return null;
  const target_m = mapped.plan.predicted.within?.target_m ?? null;
  const region = measures.region.value;
  const corners = region?.corners ?? (region === null ? [] : boxOf(region));
  const pixelAt = (event: PointerEvent & { currentTarget: Element }): Pixel => {
    const edge = event.currentTarget.getBoundingClientRect();
    const place = (at: number, size_px: number, pixels: number): number =>
      Math.min(pixels - 1, Math.max(0, Math.floor((at / size_px) * pixels)));
    return { x: place(event.clientX - edge.left, edge.width, width), y: place(event.clientY - edge.top, edge.height, height) };
  };
  return (
    <figure class="planned-map" data-field="planned_map">
      <div
        class="planned-picture"
        style={{ aspectRatio: `${width} / ${height}` }}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          begun.current = pixelAt(event);
        }}
        onPointerMove={(event) => {
          if (begun.current !== null) measures.region.value = regionOf(begun.current, pixelAt(event));
        }}
        onPointerUp={() => (begun.current = null)}
        onPointerCancel={() => (begun.current = null)}
      >
        <img src={mapped.url} alt="Predicted error of each pixel" draggable={false} />
        <svg viewBox={`0 0 ${width} ${height}`} preserveAspectRatio="none" aria-hidden="true">
          <polygon points={corners.map(({ x, y }) => `${x + 0.5},${y + 0.5}`).join(" ")} />
        </svg>
      </div>
      <figcaption class="quiet">
        Predicted error of each pixel: dark is 0
        {target_m === null ? ", bright the worst" : `, the middle colour ${engineering(target_m, "m", 2)}, bright twice that and more`}.
        Draw a box to plan for it.
      </figcaption>
    </figure>
  );
}

function boxOf({ x0, y0, x1, y1 }: { x0: number; y0: number; x1: number; y1: number }): Pixel[] {
  return [
    { x: x0, y: y0 },
    { x: x1, y: y0 },
    { x: x1, y: y1 },
    { x: x0, y: y1 },
  ];
}
