import type { Signal } from "@preact/signals";
import type { RefObject } from "preact";
import { useRef } from "preact/hooks";
import { drawnOf } from "../../store/frames";
import type { Look } from "../../store/looks";
import { MAP_PRODUCTS, type MapProduct } from "../../store/mapCatalogue";
import { useStore } from "../../store/store";
import type { ViewName } from "../../store/viewNames";
import { MapBar } from "../../ui/ColourBar";
import { Check, Tabs } from "../../ui/controls";
import { saveNumbers } from "../../ui/download";
import { captionOf } from "../../ui/figure";
import { type FigureParts, pictureFiles } from "../../ui/figureFiles";
import { useComputedOf, useDrawing, useProducts } from "../../ui/hooks";
import { LimitFields } from "../../ui/LimitFields";
import { ColourChoice } from "../../ui/LookChoices";
import { Panel } from "../../ui/Panel";
import { PopoverButton } from "../../ui/PopoverButton";
import { draw, hatch, paint } from "../../ui/paint";
import { Stage } from "../../ui/Stage";
import { Measured } from "./Measured";
import { Readout, valueAtPixel } from "./Readout";

export function MapView() {
  return <MapPanel name="map" choice={useStore().mapProduct} />;
}

/** Another map beside the first, to compare the two. */
export function SecondMapView() {
  return <MapPanel name="second-map" choice={useStore().secondMapProduct} />;
}

/** A map of one number a pixel: range, one of the lights, or how sure these are. */
function MapPanel({ name, choice }: { name: ViewName; choice: Signal<string> }) {
  const store = useStore();
  const absent = store.frames.absent.value;
  const obstacleOf = ({ product }: MapProduct): string | undefined => absent[product];
  const shown = MAP_PRODUCTS.find((each) => each.product === choice.value && obstacleOf(each) === undefined) ?? MAP_PRODUCTS[0];
  const look = store.looks.of(shown.product);
  const canvas = useRef<HTMLCanvasElement>(null);
  const parts = (): FigureParts | null => {
    const meta = look.frame.peek()?.meta;
    if (meta === undefined) return null;
    return {
      title: shown.name,
      caption: captionOf(meta, store.sequence.peek()),
      scale: look.scale.peek(),
      colours: look.colours.peek(),
      unit: shown.unit,
      ground: "white",
    };
  };
  return (
    <Panel
      name={name}
      downloads={[
        ...pictureFiles(
          () => `${shown.product}-${look.frame.peek()?.meta.frame ?? 0}`,
          () => canvas.current,
          parts,
        ),
        { text: `${shown.name} in ${shown.unit} (NPY)`, run: () => saveNumbers(store.api, look.frame.peek()) },
      ]}
      title={
        <Tabs
          label={name === "map" ? "Map" : "Second map"}
          value={shown.product}
          options={MAP_PRODUCTS.map((each) => ({ value: each.product, text: each.name, hint: each.hint, obstacle: obstacleOf(each) }))}
          onChange={(product) => (choice.value = product)}
        />
      }
      tools={<MapLookMenu key={shown.product} look={look} name={name} />}
    >
      <MapPicture look={look} canvas={canvas} />
    </Panel>
  );
}

/** How the map is coloured, behind a button: limits, scale and colours. */
function MapLookMenu({ look, name }: { look: Look; name: ViewName }) {
  const { looks } = useStore();
  return (
    <PopoverButton face="Look" label={`Look of the ${name}`} title="Limits, scale and colours" kind="look">
      <LimitFields look={look} looks={looks} />
      <Check
        checked={look.kind.value === "logarithmic"}
        onChange={(logarithmic) => (look.kind.value = logarithmic ? "logarithmic" : "linear")}
      >
        Logarithmic
      </Check>
      <ColourChoice colours={look.colours} />
    </PopoverButton>
  );
}

/** Nothing but the figures is keyed by the product: another map must not take the focus from the picture. */
function MapPicture({ look, canvas }: { look: Look; canvas: RefObject<HTMLCanvasElement | null> }) {
  const store = useStore();
  const { product: shown, frame } = look;
  useProducts([shown.product, store.frames.amplitude.value]);
  const waiting = useComputedOf([look], () => frame.value === null);
  const marked = useComputedOf([look, store], () => valueAtPixel(frame.value, store.pointed.value ?? store.selected.value));

  useDrawing(() => {
    const newest = frame.value;
    const scale = look.scale.value;
    const colours = look.colours.value;
    const target = canvas.current;
    if (target === null) return;
    if (newest === null) {
      // What the map before showed is not this one's.
      target.getContext("2d")?.clearRect(0, 0, target.width, target.height);
      delete target.dataset.frame;
      delete target.dataset.product;
      return;
    }
    const [rows, columns] = newest.shape;
    draw(target, columns, rows, (rgba) => paint(drawnOf(newest), scale, colours, rgba));
    // What the picture shows, for tests and for scripts that read the page.
    Object.assign(target.dataset, { product: shown.product, frame: newest.meta.frame, low: scale.low, high: scale.high, colours });
  }, [look]);

  return (
    <>
      <div class="picture grow spaced">
        <Stage frame={frame} label={`${shown.name} map`}>
          <canvas ref={canvas} />
          {shown.unit === "m" && <Hatch />}
        </Stage>
        <MapBar look={waiting.value ? null : look} marked={marked} />
      </div>
      <footer class="panel-foot column spaced">
        <Readout key={shown.product} look={look} />
        <Measured look={look} />
      </footer>
    </>
  );
}

/** Screen pixels of the hatch to each of the sensor's. */
const HATCH = 4;

/** Hatches the pixels whose ranges are not trusted. */
function Hatch() {
  const trust = useStore().rangeErrors.of("trust");
  const canvas = useRef<HTMLCanvasElement>(null);
  useDrawing(() => {
    const frame = trust.value;
    const [rows, columns] = frame?.shape ?? [1, 1];
    draw(canvas.current, HATCH * columns, HATCH * rows, ({ buffer }) => {
      if (frame !== null) hatch(frame.values, columns, HATCH, new Uint32Array(buffer));
    });
  }, [trust]);
  return <canvas ref={canvas} class="stage-hatch cover" title="Hatched: the range is not trusted" />;
}
