import { PIN_COLOURS } from "../store/measures";
import type { Pixel } from "../store/pixel";
import { useStore } from "../store/store";
import { type Point, seenAt } from "../store/viewport";
import { useComputedOf } from "./hooks";
import "./Marks.css";

/** What is marked in a picture of the sensor of this size: over the picture, as large at any zoom. */
export function Marks({ width, height }: { width: number; height: number }) {
  return (
    <>
      <RegionMark width={width} height={height} />
      <Crosshair of="selected" width={width} height={height} />
      <Crosshair of="pointed" width={width} height={height} />
      <Pins width={width} height={height} />
    </>
  );
}

type SizeProps = Readonly<{ width: number; height: number }>;

const percent = (share: number): string => `${100 * share}%`;

/** The crosshair of the pointed or the selected pixel; moves without rendering anything else. */
function Crosshair({ of, width, height }: SizeProps & { of: "selected" | "pointed" }) {
  const store = useStore();
  const style = useComputedOf([store, of, width, height], () => {
    const pixel = store[of].value;
    if (pixel === null) return null;
    const view = store.viewport.view.value;
    const at = seenAt(view, centreOf(pixel, width, height));
    return { "--x": percent(at.x), "--y": percent(at.y), "--w": percent(view.zoom / width), "--h": percent(view.zoom / height) };
  });
  if (style.value === null) return null;
  return (
    <div class={`mark cover mark-${of}`} style={style.value} aria-hidden="true">
      {of === "pointed" && <i class="mark-column" />}
      {of === "pointed" && <i class="mark-row" />}
      <i class="mark-pixel" />
    </div>
  );
}

function RegionMark({ width, height }: SizeProps) {
  const { measures, viewport } = useStore();
  const region = measures.region.value;
  if (region === null) return null;
  const view = viewport.view.value;
  if (region.corners !== undefined)
    return <PolygonMark corners={region.corners.map((corner) => seenAt(view, centreOf(corner, width, height)))} />;
  const [from, to] = [
    seenAt(view, { x: region.x0 / width, y: region.y0 / height }),
    seenAt(view, { x: (region.x1 + 1) / width, y: (region.y1 + 1) / height }),
  ];
  return (
    <div class="mark cover" aria-hidden="true">
      <i
        class="mark-region"
        style={{ left: percent(from.x), top: percent(from.y), width: percent(to.x - from.x), height: percent(to.y - from.y) }}
      />
    </div>
  );
}

/** A polygon, its corners in shares of the picture; each corner is marked, so that the first ones are seen too. */
function PolygonMark({ corners }: { corners: readonly Point[] }) {
  return (
    <div class="mark cover" aria-hidden="true">
      <svg class="mark-polygon cover" viewBox="0 0 1 1" preserveAspectRatio="none">
        <polygon points={corners.map(({ x, y }) => `${x},${y}`).join(" ")} />
      </svg>
      {corners.map(({ x, y }, n) => (
        <i key={n} class="mark-corner" style={{ left: percent(x), top: percent(y) }} />
      ))}
    </div>
  );
}

function Pins({ width, height }: SizeProps) {
  const { measures, viewport } = useStore();
  return (
    <div class="mark cover" aria-hidden="true">
      {measures.pins.value.map((pin) => {
        const at = seenAt(viewport.view.value, centreOf(pin, width, height));
        return (
          <b key={pin.name} class="mark-pin pin" style={{ left: percent(at.x), top: percent(at.y), "--pin": PIN_COLOURS[pin.name] }}>
            {pin.name}
            {pin.note && <span class="mark-note">{pin.note}</span>}
          </b>
        );
      })}
    </div>
  );
}

function centreOf({ x, y }: Pixel, width: number, height: number): Pixel {
  return { x: (x + 0.5) / width, y: (y + 0.5) / height };
}
