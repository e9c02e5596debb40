import { type ReadonlySignal, signal } from "@preact/signals";
import type { RefObject } from "preact";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { fixed } from "../../scales/format";
import type { Frame } from "../../store/frames";
import { PIN_COLOURS } from "../../store/measures";
import { type Pixel, stepped } from "../../store/pixel";
import { useStore } from "../../store/store";
import { useDrawing } from "../../ui/hooks";
import { lensOf, pointAt } from "./lens";
import type { PointScene } from "./Scene";

interface SceneStageProps {
  readonly canvas: RefObject<HTMLCanvasElement | null>;
  readonly scene: ReadonlySignal<PointScene | null>;
  readonly range: ReadonlySignal<Frame | null>;
}

/** What is written over the scene, at a place in CSS px. */
type Mark = Readonly<{ kind: "label" | "pin" | "selected" | "pointed"; x: number; y: number; text: string; colour?: string }>;

/** How far a pointer may move in CSS px and still click; turn of one press of an arrow key. */
const CLICK_PX = 4;
const KEY_TURN_RAD = 0.08;

const TURNS: Readonly<Record<string, readonly [number, number, number?] | undefined>> = {
  ArrowLeft: [-KEY_TURN_RAD, 0],
  ArrowRight: [KEY_TURN_RAD, 0],
  ArrowUp: [0, KEY_TURN_RAD],
  ArrowDown: [0, -KEY_TURN_RAD],
  "+": [0, 0, 0.9],
  "-": [0, 0, 1 / 0.9],
};

/** The canvas of the scene: turned by pointer and keys, its points pointed at and selected together with the pictures' pixels. */
export function SceneStage({ canvas, scene, range }: SceneStageProps) {
  const store = useStore();
  const { selected, pointed, measures } = store;
  const marks = useMemo(() => signal<readonly Mark[]>([]), []);
  const pressed = useRef<{ readonly x: number; readonly y: number } | null>(null);
  const asked = useRef(0);
  useEffect(() => () => cancelAnimationFrame(asked.current), []);

  /** Puts the marks where the scene was drawn last. */
  const place = (): void => {
    const [drawn, frame] = [scene.peek(), range.peek()];
    if (drawn === null || frame === null) return;
    const [height, width] = frame.shape;
    const lens = lensOf(store, width, height);
    const made: Mark[] = [];
    const add = (kind: Mark["kind"], point: readonly number[], text: string, colour?: string): void => {
      const at = drawn.placeOf(point);
      if (at !== null) made.push({ kind, ...at, text, ...(colour === undefined ? {} : { colour }) });
    };
    const addPixel = (kind: Mark["kind"], pixel: Pixel | null, text = "", colour?: string): void => {
      const range_m = pixel === null ? NaN : frame.values[pixel.y * width + pixel.x];
      if (pixel !== null && Number.isFinite(range_m)) add(kind, pointAt(lens, { ...pixel, range_m }), text, colour);
    };
    for (const { at, value_m } of drawn.labels) add("label", at, fixed(value_m, value_m % 1 === 0 ? 0 : 1, "m"));
    for (const pin of measures.pins.peek()) addPixel("pin", pin, pin.name, PIN_COLOURS[pin.name]);
    addPixel("selected", selected.peek());
    addPixel("pointed", pointed.peek());
    marks.value = made;
  };
  useDrawing(() => {
    if (scene.value !== null) scene.value.onDrawn = place;
  }, [scene]);
  useDrawing(() => {
    void [selected.value, pointed.value, measures.pins.value];
    place();
  }, [scene, range]);

  const pixelAt = (event: MouseEvent): Pixel | null => {
    const [drawn, frame] = [scene.peek(), range.peek()];
    if (drawn === null || frame === null) return null;
    const pixel = drawn.pixelAt(event.offsetX, event.offsetY);
    const width = frame.shape[1];
    return pixel === null ? null : { x: pixel % width, y: Math.floor(pixel / width) };
  };
  /** At most once a refresh: all points are looked through. */
  const onPointerMove = (event: PointerEvent): void => {
    if (event.buttons !== 0) return;
    cancelAnimationFrame(asked.current);
    asked.current = requestAnimationFrame(() => (pointed.value = pixelAt(event)));
  };
  const onPointerUp = (event: PointerEvent): void => {
    const from = pressed.current;
    pressed.current = null;
    if (from === null || Math.hypot(event.clientX - from.x, event.clientY - from.y) > CLICK_PX) return;
    const pixel = pixelAt(event);
    if (pixel === null) return;
    if (event.shiftKey) measures.pin(pixel);
    else selected.value = pixel;
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = TURNS[event.key];
    const [height, width] = range.peek()?.shape ?? [0, 0];
    const moved = event.shiftKey && width > 0 ? stepped(selected.peek(), event.key, width, height) : null;
    if (moved !== null) selected.value = moved;
    else if (turn !== undefined) scene.peek()?.turn(...turn);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <>
      <canvas
        ref={canvas}
        class="cover"
        data-product="points"
        tabIndex={0}
        role="application"
        aria-roledescription="point cloud"
        aria-label="Points in space. Drag or press arrow keys to turn, plus and minus to come nearer or go. Click a point, or press Shift and an arrow key, to show its impulse response."
        onKeyDown={onKeyDown}
        onPointerMove={onPointerMove}
        onPointerLeave={() => {
          cancelAnimationFrame(asked.current);
          pointed.value = null;
        }}
        onPointerDown={(event) => (pressed.current = event.button === 0 ? { x: event.clientX, y: event.clientY } : null)}
        onPointerUp={onPointerUp}
      />
      <div class="mark cover scene-marks" aria-hidden="true">
        {marks.value.map(({ kind, x, y, text, colour }, n) => (
          <span
            key={n}
            class={`scene-mark tick small scene-mark-${kind}`}
            style={{ left: `${x}px`, top: `${y}px`, ...(colour === undefined ? {} : { "--pin": colour }) }}
          >
            {text}
          </span>
        ))}
      </div>
    </>
  );
}
