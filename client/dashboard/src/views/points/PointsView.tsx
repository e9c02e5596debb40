import { signal, useComputed } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { LightPainter } from "../../gl/paintLight";
import { fixed, grouped, numberOf } from "../../scales/format";
import { LIVE } from "../../store/api";
import type { Frame } from "../../store/frames";
import { aBoolean, aNumber, oneOf, type Setting } from "../../store/settings";
import { useStore } from "../../store/store";
import { frameUrl } from "../../stream/frameUrl";
import { MapBar } from "../../ui/ColourBar";
import { Button, Choice, Toggle } from "../../ui/controls";
import { download, saveTable } from "../../ui/download";
import { captionOf } from "../../ui/figure";
import { type FigureParts, pictureFiles } from "../../ui/figureFiles";
import { useDrawing, useProducts, useSize } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { PopoverButton } from "../../ui/PopoverButton";
import { FirstFrame } from "../../ui/Stage";
import { PinsRow } from "../map/PinsRow";
import { backdropOf, LightBar, lightScale } from "../transient/LightBar";
import { byFlags, byPicture, byValue, colourCloud, fieldOfView, fillCloud, type Painter, pointRows } from "./cloud";
import { FIELD_DEG, FIELDS_DEG, knownLens, lensOf } from "./lens";
import type { PointScene } from "./Scene";
import { SceneStage } from "./SceneStage";
import "../../ui/Ticks.css";
import "./PointsView.css";
import { DEGREE } from "../../physics/constants";

const COLOURINGS = ["range", "light", "validity", "flight"] as const;
type Colouring = (typeof COLOURINGS)[number];
const NAMES: Record<Exclude<Colouring, "light">, string> = { range: "range", validity: "validity", flight: "light in flight" };
/** What the colours are made of, besides the range and the light. */
const NEEDED: Record<Colouring, readonly string[]> = { range: [], light: [], validity: ["flags"], flight: ["coefficients"] };

const COLOURING: Setting<Colouring> = { key: "points.colouring", link: "points", initial: "range", ...oneOf(COLOURINGS) };
const SIZE_PX: Setting<number> = { key: "points.size", initial: 2, ...aNumber() };
const SHADED: Setting<boolean> = { key: "points.shaded", initial: true, ...aBoolean() };
const SURROUNDED: Setting<boolean> = { key: "points.surrounded", initial: true, ...aBoolean() };

/** The range map as points in space. */
export function PointsView() {
  const store = useStore();
  const colouring = store.settings.of(COLOURING);
  const pointSize = store.settings.of(SIZE_PX);
  const shaded = store.settings.of(SHADED);
  const surrounded = store.settings.of(SURROUNDED);
  const { light } = store;
  const ofLight = store.frames.amplitude.value;
  const [rangeLook, lightLook] = [store.looks.of("range"), store.looks.of(ofLight)];
  const isLit = colouring.value === "light" || colouring.value === "flight";
  useProducts(["range", ...NEEDED[colouring.value], ...(isLit ? [ofLight] : [])]);
  const range = store.frames.of("range");
  const canvas = useRef<HTMLCanvasElement>(null);
  const box = useRef<HTMLDivElement>(null);
  const size = useSize(box);
  const scene = useMemo(() => signal<PointScene | null>(null), []);
  const trouble = useMemo(() => signal<string | null>(null), []);
  const count = useMemo(() => signal(0), []);
  /** Counts the clouds, which all lie in the same arrays. */
  const cloud = useMemo(() => signal(0), []);
  const lit = useMemo(() => ({ painter: new LightPainter(), pixels: new Uint32Array(0) }), []);

  useEffect(() => {
    let wanted = true;
    void import("./Scene").then(
      ({ PointScene: Made }) => {
        if (!wanted || canvas.current === null) return;
        try {
          scene.value = new Made(canvas.current);
        } catch {
          trouble.value = "This browser grants no WebGL, which points in space need.";
        }
      },
      () => (trouble.value = "The part of the page that draws points could not be loaded."),
    );
    return () => {
      wanted = false;
      scene.peek()?.dispose();
      scene.value = null;
    };
  }, [scene, trouble]);

  useDrawing(() => {
    const { width, height } = size.value;
    if (width > 0 && height > 0) scene.value?.resize(width, height);
  }, [scene, size]);

  useDrawing(() => {
    if (scene.value === null) return;
    scene.value.pointSize_px = pointSize.value;
    scene.value.shaded = shaded.value;
    scene.value.surrounded = surrounded.value;
  }, [scene]);

  useDrawing(() => {
    const [frame, drawn] = [range.value, scene.value];
    if (frame === null || drawn === null) return;
    const [height, width] = frame.shape;
    const lens = lensOf(store, width, height);
    count.value = fillCloud(drawn.cloudFor(width * height), frame.values, width, lens);
    drawn.show(count.value, { width, height, lens });
    cloud.value = cloud.peek() + 1;
  }, [scene, range]);

  /** How the points are coloured; by their range where what is wanted has not come yet. */
  const painter = (frame: Frame, chosen: Colouring): Painter => {
    const of = (product: string): Frame | null => {
      const other = store.frames.of(product).value;
      return other?.values.length === frame.values.length ? other : null;
    };
    const amplitude = chosen === "light" || chosen === "flight" ? of(ofLight) : null;
    const flags = chosen === "validity" ? of("flags") : null;
    const coefficients = chosen === "flight" ? (store.frames.of("coefficients").value?.coefficients ?? null) : null;
    if (flags !== null) return byFlags(flags.values);
    if (coefficients !== null && coefficients.width * coefficients.height === frame.values.length) {
      if (lit.pixels.length !== frame.values.length) lit.pixels = new Uint32Array(frame.values.length);
      const [phase_rad, backdrop] = [store.player.phase_rad.value, backdropOf(amplitude, light)];
      lit.painter.paint(coefficients, { phase_rad, tone: light.toneNow, colours: light.colours.value, backdrop }, lit.pixels);
      return byPicture(lit.pixels);
    }
    if (chosen === "light" && amplitude !== null) return byValue(amplitude.values, lightLook.scale.value, lightLook.colours.value);
    return byValue(frame.values, rangeLook.scale.value, rangeLook.colours.value);
  };
  useDrawing(() => {
    const [frame, chosen, drawn, made] = [range.value, colouring.value, scene.value, cloud.value];
    if (frame === null || drawn === null || made === 0) return;
    colourCloud(drawn.cloudFor(frame.values.length), count.peek(), painter(frame, chosen));
    drawn.recolour();
    const shown = { frame: frame.meta.frame, points: count.peek(), colouring: chosen, ...rangeLook.scale.peek() };
    if (canvas.current !== null) Object.assign(canvas.current.dataset, shown);
  }, [scene, range]);

  const saveShown = (): void => {
    const [frame, drawn] = [range.peek(), scene.peek()];
    if (frame === null || drawn === null) return;
    const light = store.frames.of(ofLight).peek();
    const values = { range_m: frame.values, ...(light?.meta.frame === frame.meta.frame ? { [`${ofLight}_dn`]: light.values } : {}) };
    saveTable(`points-${frame.meta.frame}`, pointRows(drawn.cloudFor(frame.values.length), count.peek(), frame.shape[1], values));
  };
  const parts = (): FigureParts | null => {
    const [frame, chosen] = [range.peek(), colouring.peek()];
    if (frame === null) return null;
    const look = chosen === "light" ? lightLook : rangeLook;
    const bar = { scale: chosen === "validity" ? null : look.scale.peek(), colours: look.colours.peek(), unit: look.product.unit };
    const flight = chosen === "flight" ? { ...lightScale(light, store, "density"), colours: light.colours.peek() } : {};
    const title = `Points in space, coloured by ${chosen === "light" ? ofLight : NAMES[chosen]}`;
    return { title, caption: captionOf(frame.meta, store.sequence.peek()), ground: "black", sides: "space", ...bar, ...flight };
  };
  /** Drawn anew, as it can be read in the task that drew it alone. */
  const snapshot = (): HTMLCanvasElement | null => {
    scene.peek()?.drawNow();
    return canvas.current;
  };
  const saveAll = async (): Promise<void> => {
    const frame = range.peek();
    if (frame === null) return;
    const place = frame.origin === LIVE ? `/frames/${frame.meta.frame}` : frame.origin;
    const file = `pointcloud-${frame.meta.frame}.ply`;
    await store.events.reported(() => download(store.api, frameUrl(place, "pointcloud.ply"), file));
  };

  const frameless = useComputed(() => range.value === null);
  const loading = useComputed(() => scene.value === null);
  return (
    <Panel
      tools={
        <PopoverButton face="Look" label="Look of the points" title="What the points are coloured by, and their size" kind="look">
          <Choice label="Colour by" chosen={colouring} of={COLOURINGS} text={(each) => (each === "light" ? ofLight : NAMES[each])} />
          <Choice label="Size of a point" chosen={pointSize} of={[1, 2, 3, 4, 6]} text={(each) => `${each} px`} />
        </PopoverButton>
      }
      downloads={[
        ...pictureFiles(() => `points-${range.peek()?.meta.frame ?? 0}`, snapshot, parts),
        { text: "Points as streamed (CSV)", run: saveShown },
        { text: "Points with light and flags (PLY)", run: () => void saveAll() },
      ]}
    >
      <div class="picture grow spaced">
        <div class="points grow" ref={box}>
          <SceneStage canvas={canvas} scene={scene} range={range} />
          {trouble.value !== null ? (
            <p class="stage-empty cover">{trouble.value}</p>
          ) : frameless.value ? (
            <FirstFrame />
          ) : (
            loading.value && <p class="stage-empty cover">Loading</p>
          )}
        </div>
        {colouring.value === "flight" ? (
          <LightBar look={light} play="density" />
        ) : (
          <MapBar look={{ range: rangeLook, light: lightLook, validity: null }[colouring.value]} />
        )}
      </div>
      <footer class="panel-foot column spaced">
        <div class="panel-row wrapped apart">
          <span>
            <span data-field="points">{grouped(count.value)}</span> <span class="quiet">points</span>
          </span>
          <FieldOfView />
          <span class="wrapped spaced">
            <Toggle on={surrounded} title="Floor with a grid in metres, the camera's axes (x red, y green, z blue) and its field of view">
              Grid
            </Toggle>
            <Toggle
              on={shaded}
              title="Eye-dome lighting: what stands behind its neighbours is darker. Without it colours are exactly those of the colour bar"
            >
              Shading
            </Toggle>
            <Button onClick={() => scene.peek()?.fromCamera()}>Camera's eye</Button>
            <Button onClick={() => scene.peek()?.aside()}>Aside</Button>
          </span>
        </div>
        {store.measures.pins.value.length > 0 && <PinsRow look={rangeLook} />}
      </footer>
    </Panel>
  );
}

/** How wide the camera looks: as the service says, or to be set where it does not know. */
function FieldOfView() {
  const store = useStore();
  const field_deg = store.settings.of(FIELD_DEG);
  const known = knownLens(store);
  if (known !== null) {
    return (
      <span title={`As the ${known.source} says`} data-field="field_of_view">
        <span class="quiet">field of view</span> {fixed(fieldOfView(known.width, known) / DEGREE, 1, "°")}
      </span>
    );
  }
  return (
    <label class="choice inline-row" title="How wide the camera looks, across: the service does not know">
      <span class="quiet">field of view</span>
      <input
        class="limit"
        type="text"
        inputMode="decimal"
        value={field_deg.value}
        aria-label="Horizontal field of view in degrees"
        onChange={(event) => {
          const typed_deg = numberOf(event.currentTarget.value);
          if (FIELDS_DEG.accepts(typed_deg)) field_deg.value = typed_deg;
        }}
      />
      °
    </label>
  );
}
