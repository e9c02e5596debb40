import type { ReadonlySignal, Signal } from "@preact/signals";
import type { ComponentChildren, RefObject } from "preact";
import { useRef } from "preact/hooks";
import { type Way, wiped } from "../../store/comparison";
import { drawnOf, type Frame } from "../../store/frames";
import type { Look } from "../../store/looks";
import type { MapProduct } from "../../store/mapCatalogue";
import { useStore } from "../../store/store";
import type { ViewName } from "../../store/viewNames";
import { MapBar } from "../../ui/ColourBar";
import { Check, ColourChoice, Tabs } from "../../ui/controls";
import { saveNumbers } from "../../ui/download";
import { captionOf } from "../../ui/figure";
import { type FigureParts, pictureFiles } from "../../ui/figureFiles";
import { useComputedOf, useDrawing, useProducts } from "../../ui/hooks";
import { LimitFields } from "../../ui/LimitFields";
import { Panel } from "../../ui/Panel";
import { PopoverButton } from "../../ui/PopoverButton";
import { draw, grey, hatch, paint } from "../../ui/paint";
import { Stage } from "../../ui/Stage";
import { Compared, CompareMenu, sourceWords } from "./Compared";
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
  const maps = store.frames.maps.value;
  const shown = maps.find((each) => each.product === choice.value && obstacleOf(each) === undefined) ?? maps[0];
  const base = store.looks.of(shown.product);
  const [{ b }, way, source] = [store.comparison.of(shown.product), store.comparison.ways[name], store.comparison.source.value];
  const blinked = store.comparison.blinked.value ? "B" : "A";
  const now = b.value === null ? "A" : way.value === "blink" ? blinked : way.value;
  const look = now === "difference" ? store.looks.of(`${shown.product}-difference`) : base;
  const picture = usePicture(now, look, b);
  const canvas = useRef<HTMLCanvasElement>(null);
  const compared = (): string => (now === "A" ? "" : ` ${now === "difference" ? "minus" : `(${now})`} ${sourceWords(store)}`);
  const fileName = (): string => `${look.product.product}-${picture.peek()?.meta.frame ?? 0}`;
  const parts = (): FigureParts | null => {
    const meta = picture.peek()?.meta;
    if (meta === undefined) return null;
    return {
      title: look.product.name + compared(),
      caption: captionOf(meta, store.sequence.peek(), store.measures.notes),
      scale: look.scale.peek(),
      colours: look.colours.peek(),
      unit: shown.unit,
      ground: "white",
    };
  };
  return (
    <Panel
      downloads={[
        ...pictureFiles(fileName, () => canvas.current, parts),
        { text: `${look.product.name} in ${shown.unit} (NPY)`, run: () => saveNumbers(store.api, picture.peek()) },
      ]}
      title={
        <Tabs
          label={name === "map" ? "Map" : "Second map"}
          value={shown.product}
          options={maps.map((each) => ({ value: each.product, text: each.name, hint: each.hint, obstacle: obstacleOf(each) }))}
          onChange={(product) => (choice.value = product)}
        />
      }
      tools={
        <>
          <CompareMenu look={base} name={name} way={way} />
          <MapLookMenu key={look.product.product} look={look} name={name} />
        </>
      }
    >
      <MapPicture look={look} picture={picture} canvas={canvas}>
        <Readout key={shown.product} look={base} />
        {source !== null && <Compared source={source} look={base} way={way} />}
        <Measured look={look} />
      </MapPicture>
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

/** What is drawn of A and B: one of them, their difference, or both beside the column that is pointed at. */
function usePicture(way: Way, look: Look, b: ReadonlySignal<Frame | null>): ReadonlySignal<Frame | null> {
  const { pointed, selected } = useStore();
  return useComputedOf([way, look, b], () => {
    const [one, other] = [look.frame.value, b.value];
    if (way !== "wipe" || one === null || other === null) return way === "B" ? other : one;
    return wiped(one, other, (pointed.value ?? selected.value)?.x ?? one.shape[1] >> 1);
  });
}

interface MapPictureProps {
  readonly look: Look;
  readonly picture: ReadonlySignal<Frame | null>;
  readonly canvas: RefObject<HTMLCanvasElement | null>;
  readonly children: ComponentChildren;
}

/** Nothing but the figures is keyed by the product: another map must not take the focus from the picture. */
function MapPicture({ look, picture: frame, canvas, children }: MapPictureProps) {
  const store = useStore();
  const shown = look.product;
  useProducts([shown.product.replace(/-difference$/, ""), store.frames.amplitude.value]);
  const waiting = useComputedOf([frame], () => frame.value === null);
  const marked = useComputedOf([frame, store], () => valueAtPixel(frame.value, store.pointed.value ?? store.selected.value));
  const doubtful = shown.product === "range-difference" ? store.comparison.error_m : null;

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
    const errors = doubtful?.value ?? null;
    draw(target, columns, rows, (rgba) => {
      paint(drawnOf(newest), scale, colours, rgba);
      if (errors !== null) grey(newest.values, errors, rgba);
    });
    // What the picture shows, for tests and for scripts that read the page.
    Object.assign(target.dataset, { product: shown.product, frame: newest.meta.frame, low: scale.low, high: scale.high, colours });
  }, [look, frame, doubtful]);

  return (
    <>
      <div class="picture grow spaced">
        <Stage frame={frame} label={`${shown.name} map`}>
          <canvas ref={canvas} />
          {shown.unit === "m" && doubtful === null && <Hatch />}
        </Stage>
        <MapBar look={waiting.value ? null : look} marked={marked} values={frame} />
      </div>
      <footer class="panel-foot column spaced">{children}</footer>
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
