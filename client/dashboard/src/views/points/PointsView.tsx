import { signal, useComputed } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";

import { LIVE, RequestError } from "../../store/api";
import { aNumber, oneOf, remembered } from "../../store/settings";
import { isField, useStore } from "../../store/store";
import { frameUrl } from "../../stream/frameUrl";
import { ColourBar } from "../../ui/ColourBar";
import { Choice } from "../../ui/controls";
import { save, savePicture } from "../../ui/download";
import { download } from "../../ui/files";
import { fixed, grouped } from "../../ui/format";
import { useDrawing, useProducts, useSize } from "../../ui/hooks";
import { Panel } from "../../ui/Panel";
import { AMPLITUDE } from "../map/catalogue";
import { byFlags, byValue, fieldOfView, fillCloud } from "./cloud";
import { knownLens, lensOf } from "./lens";
import { plyOf } from "./ply";
import type { PointScene } from "./Scene";

const COLOURINGS = ["range", "light", "validity"] as const;
type Colouring = (typeof COLOURINGS)[number];
const NEEDED: Record<Colouring, readonly string[]> = { range: ["range"], light: ["range", AMPLITUDE], validity: ["range", "flags"] };

/** Turn of one press of an arrow key. */
const KEY_TURN_RAD = 0.08;
const DEGREE = Math.PI / 180;

/** The range map as points in space. */
export function PointsView() {
  const store = useStore();
  const colouring = useMemo(() => remembered<Colouring>(store.shelf, "points.colouring", "range", oneOf(COLOURINGS)), [store]);
  const pointSize = useMemo(() => remembered(store.shelf, "points.size", 2, aNumber), [store]);
  const { field_deg } = store;
  const known = useComputed(() => knownLens(store));
  const [rangeLook, lightLook] = [store.looks.of("range"), store.looks.of(AMPLITUDE)];
  useProducts(NEEDED[colouring.value]);
  const range = store.frames.of("range");
  const canvas = useRef<HTMLCanvasElement>(null);
  const box = useRef<HTMLDivElement>(null);
  const size = useMemo(() => signal({ width: 0, height: 0 }), []);
  useSize(box, size);
  const scene = useMemo(() => signal<PointScene | null>(null), []);
  const trouble = useMemo(() => signal<string | null>(null), []);
  const count = useMemo(() => signal(0), []);

  useEffect(() => {
    let wanted = true;
    void import("./Scene").then(({ PointScene: Made }) => {
      if (!wanted || canvas.current === null) return;
      try {
        scene.value = new Made(canvas.current);
      } catch {
        trouble.value = "This browser grants no WebGL, which points in space need.";
      }
    }, () => (trouble.value = "The part of the page that draws points could not be loaded.")); // prettier-ignore
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
    if (scene.value !== null) scene.value.pointSize_px = pointSize.value;
  }, [scene]);

  useDrawing(() => {
    const [frame, chosen, drawn] = [range.value, colouring.value, scene.value];
    const other = chosen === "light" ? store.frames.of(AMPLITUDE).value : chosen === "validity" ? store.frames.of("flags").value : null;
    if (frame === null || drawn === null) return;
    const [height, width] = frame.shape;
    const lens = lensOf(store, width, height);
    const fits = other?.values.length === frame.values.length;
    const colourOf =
      chosen === "validity" && fits
        ? byFlags(other.values)
        : chosen === "light" && fits
          ? byValue(other.values, lightLook.scale.value, lightLook.colours.value)
          : byValue(frame.values, rangeLook.scale.value, rangeLook.colours.value);
    count.value = fillCloud(drawn.cloudFor(width * height), frame.values, width, lens, colourOf);
    drawn.show(count.value, { width, height, fieldOfView_rad: fieldOfView(width, lens) });
    if (canvas.current !== null) Object.assign(canvas.current.dataset, { frame: frame.meta.frame, points: count.value, colouring: chosen, ...rangeLook.scale.peek() });
  }, [scene, range]);

  const saveShown = (): void => {
    const [frame, drawn] = [range.peek(), scene.peek()];
    if (frame === null || drawn === null) return;
    const [height, width] = frame.shape;
    const { fx, fy, cx, cy } = lensOf(store, width, height);
    const facts = { frame: frame.meta.frame, intrinsics: { fx, fy, cx, cy, width, height, source: known.peek()?.source ?? "assumed" } };
    save(`points-${frame.meta.frame}.ply`, new Blob([plyOf(drawn.cloudFor(width * height), count.peek(), facts)]));
  };
  const saveAll = async (): Promise<void> => {
    const frame = range.peek();
    if (frame === null) return;
    const place = frame.origin === LIVE ? `/frames/${frame.meta.frame}` : frame.origin;
    try {
      await download(store.api, frameUrl(place, "pointcloud.ply"), `pointcloud-${frame.meta.frame}.ply`);
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      store.status.unreadable.value = error.message;
    }
  };

  const onKeyDown = (event: KeyboardEvent): void => {
    const turn = TURNS[event.key];
    if (turn === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    scene.peek()?.turn(...turn);
  };
  const bar = useComputed(() => (colouring.value === "validity" ? null : colouring.value === "light" ? lightLook : rangeLook));
  const text = useComputed(() => (range.value === null ? "Waiting for the first frame" : scene.value === null ? "Loading" : null));
  return (
    <Panel
      name="points"
      title={<h2>Points in space</h2>}
      tools={
        <>
          <Choice label="Colour by" value={colouring.value} options={COLOURINGS.map((each) => ({ value: each, text: each }))} onChange={(each) => (colouring.value = each)} />
          <Choice label="Size of a point" value={pointSize.value} options={[1, 2, 3, 4, 6].map((each) => ({ value: each, text: `${each} px` }))} onChange={(each) => (pointSize.value = each)} />
        </>
      }
      downloads={[
        {
          text: "Picture (PNG)",
          run: () => {
            scene.peek()?.drawNow();
            savePicture(`points-${range.peek()?.meta.frame ?? 0}`, canvas.current);
          },
        },
        { text: "Points as shown (PLY)", run: saveShown },
        { text: "Points with light and flags (PLY)", run: () => void saveAll() },
      ]}
    >
      <div class="picture">
      <div class="points" ref={box}>
        <canvas
          ref={canvas}
          data-product="points"
          tabIndex={0}
          role="application"
          aria-roledescription="point cloud"
          aria-label="Points in space. Drag or press arrow keys to turn, plus and minus to come nearer or go."
          onKeyDown={onKeyDown}
        />
        {(trouble.value ?? text.value) !== null && <p class="stage-empty">{trouble.value ?? text.value}</p>}
      </div>
        {bar.value === null ? (
          <div class="colour-bar" />
        ) : (
          <ColourBar
            scale={bar.value.scale.value}
            colours={bar.value.colours.value}
            unit={bar.value.product.unit}
            values={bar.value.frame}
            onLimit={(limits) => {
              if (bar.value !== null) store.looks.limit(bar.value, limits);
            }}
          />
        )}
      </div>
      <footer class="panel-foot">
        <div class="panel-row">
          <span>
            <span data-field="points">{grouped(count.value)}</span> <span class="quiet">points</span>
          </span>
          {known.value !== null ? (
            <span title={`As the ${known.value.source} says`} data-field="field_of_view">
              <span class="quiet">field of view</span> {fixed(fieldOfView(known.value.width, known.value) / DEGREE, 1, "°")}
            </span>
          ) : (
            <label class="choice" title="How wide the camera looks, across: the service does not know">
              <span class="quiet">field of view</span>
              <input
                class="limit"
                type="number"
                min={5}
                max={150}
                value={field_deg.value}
                aria-label="Horizontal field of view in degrees"
                onChange={(event) => {
                  if (isField(event.currentTarget.valueAsNumber)) field_deg.value = event.currentTarget.valueAsNumber;
                }}
              />
              °
            </label>
          )}
          <span class="panel-tools">
            <button type="button" onClick={() => scene.peek()?.fromCamera()}>
              Camera's eye
            </button>
            <button type="button" onClick={() => scene.peek()?.aside()}>
              Aside
            </button>
          </span>
        </div>
      </footer>
    </Panel>
  );
}

const TURNS: Readonly<Record<string, readonly [number, number, number?] | undefined>> = {
  ArrowLeft: [-KEY_TURN_RAD, 0],
  ArrowRight: [KEY_TURN_RAD, 0],
  ArrowUp: [0, KEY_TURN_RAD],
  ArrowDown: [0, -KEY_TURN_RAD],
  "+": [0, 0, 0.9],
  "-": [0, 0, 1 / 0.9],
};
