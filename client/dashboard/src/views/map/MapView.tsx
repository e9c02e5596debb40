import { computed, useComputed, type ReadonlySignal } from "@preact/signals";
import type { RefObject } from "preact";
import { useMemo, useRef } from "preact/hooks";

import type { Frame } from "../../store/frames";
import type { Pixel } from "../../store/pixel";
import { useStore } from "../../store/store";
import { COLOUR_MAPS } from "../../ui/colourMaps";
import { Choice, Tabs, Toggle } from "../../ui/controls";
import { saveNumbers, savePicture } from "../../ui/download";
import { fixed, NOTHING } from "../../ui/format";
import { useDrawing, useProducts } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { Stage } from "../../ui/Stage";
import { AMPLITUDE, MAP_PRODUCTS, type MapProduct } from "./catalogue";
import { ColourBar } from "./ColourBar";
import { LimitFields } from "./LimitFields";
import { MapLook } from "./limits";
import { paint } from "./paint";

/** Value of a frame at a pixel; NaN without a frame, a pixel or a value. */
function valueOf(frame: Frame | null, pixel: Pixel | null): number {
  if (frame === null || pixel === null) return NaN;
  const [height, width] = frame.shape;
  return pixel.x < width && pixel.y < height ? frame.values[pixel.y * width + pixel.x] : NaN;
}

/** A map of one number a pixel: range, or one of the lights. */
export function MapView() {
  const store = useStore();
  const choice = store.mapProduct;
  const shown = MAP_PRODUCTS.find(({ product }) => product === choice.value) ?? MAP_PRODUCTS[0];
  const frame = store.frames.of(shown.product);
  const look = useMemo(() => new MapLook(shown, frame, store.shelf), [shown, frame, store]);
  const canvas = useRef<HTMLCanvasElement>(null);
  return (
    <Panel
      name="map"
      downloads={[
        { text: "Picture (PNG)", run: () => { savePicture(`${shown.product}-${frame.peek()?.meta.frame ?? 0}`, canvas.current); } },
        { text: `${shown.name} in ${shown.unit} (NPY)`, run: () => { saveNumbers(frame.peek()); } },
      ]} // prettier-ignore
      title={
        <Tabs
          label="Map"
          value={shown.product}
          options={MAP_PRODUCTS.map(({ product, name, hint }) => ({ value: product, text: name, hint }))}
          onChange={(product) => (choice.value = product)}
        />
      }
      tools={
        <>
          <Toggle
            pressed={look.kind.value === "logarithmic"}
            title="Logarithmic scale"
            onToggle={() => (look.kind.value = look.kind.peek() === "linear" ? "logarithmic" : "linear")}
          >
            log
          </Toggle>
          <Choice
            label="Colours"
            value={look.colours.value}
            options={COLOUR_MAPS.map((name) => ({ value: name, text: name }))}
            onChange={(name) => (look.colours.value = name)}
          />
        </>
      }
    >
      <Map key={shown.product} shown={shown} frame={frame} look={look} canvas={canvas} />
    </Panel>
  );
}

interface MapProps {
  readonly shown: MapProduct;
  readonly frame: ReadonlySignal<Frame | null>;
  readonly look: MapLook;
  readonly canvas: RefObject<HTMLCanvasElement | null>;
}

function Map({ shown, frame, look, canvas }: MapProps) {
  const store = useStore();
  useProducts([shown.product, AMPLITUDE]);
  const size = useComputed(() => {
    const [height, width] = frame.value?.shape ?? [120, 163];
    return `${width}x${height}`;
  });
  const [width, height] = size.value.split("x").map(Number);
  const looked = useMemo(() => computed(() => store.pointed.value ?? store.selected.value), [store]);
  const marked = useMemo(() => computed(() => valueOf(frame.value, looked.value)), [frame, looked]);

  useDrawing(() => {
    const newest = frame.value;
    const scale = look.scale.value;
    const colours = look.colours.value;
    const target = canvas.current;
    if (newest === null || target === null) return;
    const [rows, columns] = newest.shape;
    const context = target.getContext("2d");
    if (context === null) return;
    if (target.width !== columns || target.height !== rows) [target.width, target.height] = [columns, rows];
    const image = context.createImageData(columns, rows);
    paint(newest.values, scale, colours, image.data);
    context.putImageData(image, 0, 0);
    // What the picture shows, for tests and for scripts that read the page.
    Object.assign(target.dataset, { frame: newest.meta.frame, low: scale.low, high: scale.high, colours });
  }, [frame, look]);

  return (
    <>
      <Stage width={width} height={height} label={`${shown.name} map`}>
        <canvas ref={canvas} data-product={shown.product} />
        {useComputed(() => frame.value === null).value && <p class="stage-empty">Waiting for the first frame</p>}
      </Stage>
      <footer class="panel-foot">
        <ColourBar scale={look.scale.value} colours={look.colours.value} unit={shown.unit} marked={marked} />
        <div class="panel-row">
          <Readout shown={shown} frame={frame} looked={looked} marked={marked} />
          <LimitFields look={look} unit={shown.unit} />
        </div>
      </footer>
    </>
  );
}

interface ReadoutProps {
  readonly shown: MapProduct;
  readonly frame: ReadonlySignal<Frame | null>;
  readonly looked: ReadonlySignal<Pixel | null>;
  readonly marked: ReadonlySignal<number>;
}

/** The value under the pointer, and how much light it rests on. */
function Readout({ shown, frame, looked, marked }: ReadoutProps) {
  const store = useStore();
  const amplitude = store.frames.of(AMPLITUDE);
  const place = useComputed(() => (looked.value === null ? "" : `${looked.value.x}, ${looked.value.y}`));
  const value = useComputed(() => fixed(marked.value, shown.decimals, shown.unit));
  const light = useComputed(() => fixed(valueOf(amplitude.value, looked.value), 0, amplitude.value?.unit ?? ""));
  const number = useComputed(() => frame.value?.meta.frame ?? "");
  if (place.value === "") return <p class="readout quiet">Point at the picture to read it.</p>;
  return (
    <p class="readout" data-frame={number} aria-live="off">
      <output class="readout-value" data-field="value">
        {value}
      </output>
      {shown.product !== AMPLITUDE && (
        <span>
          <span class="quiet">light</span> <span data-field="amplitude">{light}</span>
        </span>
      )}
      <span class="quiet">
        pixel <span data-field="pixel">{place}</span>
      </span>
      {value.value === NOTHING && <span class="quiet">no value here</span>}
    </p>
  );
}
