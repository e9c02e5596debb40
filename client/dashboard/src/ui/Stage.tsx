import { type ReadonlySignal, useComputed } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { type Frame, sentWords } from "../store/frames";
import { regionOf } from "../store/measures";
import { type Pixel, stepped } from "../store/pixel";
import { useStore } from "../store/store";
import { type Point, placeIn, WHOLE } from "../store/viewport";
import { useComputedOf, usePictureSize } from "./hooks";
import { Marks } from "./Marks";
import "./Stage.css";

interface StageProps {
  readonly label: string;
  /** What it is a picture of. */
  readonly frame: ReadonlySignal<Frame | null>;
  /** The canvas; before the first frame it is said what is waited for. */
  readonly children: ComponentChildren;
}

/** How far a pointer may move in CSS px and still click. */
const CLICK_PX = 4;
/** One notch of a wheel, 100 units, and one press of a key. */
const ZOOM_PER_UNIT = 1.002;
const KEY_ZOOM = 1.25;
/** How long a finger stays to pin. */
const STAYS_S = 0.5;

interface Drag {
  readonly kind: "pan" | "region" | "corner";
  readonly from: Pixel;
  last: PointerEvent;
  moved: boolean;
}

/**
 * A picture of the sensor that fits its panel, with a crosshair; all stages show the same part of it.
 *
 * Pointing at it sets the pointed pixel, a click or tap selects one, for all views alike; the wheel zooms, dragging
 * moves what is zoomed, a double click shows it whole again. With Shift a click pins a pixel and dragging marks a
 * region; with Ctrl or Cmd a click sets a corner of a region. Two fingers zoom and move, one that stays pins a pixel. With the stage focused, Shift and the arrow keys move the
 * selected pixel, + and − zoom, Enter pins it, R marks a region around it, C sets a corner there and Escape takes
 * regions and pins away.
 */
export function Stage({ label, frame, children }: StageProps) {
  const [width, height] = usePictureSize(frame);
  const store = useStore();
  const { viewport, measures } = store;
  const picture = useRef<HTMLDivElement>(null);
  const drag = useRef<Drag | null>(null);
  /** Where fingers touch the picture, and what happens when one stays. */
  const fingers = useRef(new Map<number, PointerEvent>());
  const stays = useRef<ReturnType<typeof setTimeout>>(undefined);

  const shareAt = (event: MouseEvent): Point => {
    const box = (picture.current as HTMLElement).getBoundingClientRect();
    return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
  };
  const pixelAt = (event: MouseEvent): Pixel => {
    const place = placeIn(viewport.view.peek(), shareAt(event));
    const clamp = (value: number, end: number): number => Math.min(end - 1, Math.max(0, Math.floor(value)));
    return { x: clamp(place.x * width, width), y: clamp(place.y * height, height) };
  };

  useEffect(() => {
    const target = picture.current;
    // Not by onWheel: the page would scroll meanwhile.
    const onWheel = (event: WheelEvent): void => {
      event.preventDefault();
      viewport.zoomAt(shareAt(event), ZOOM_PER_UNIT ** -event.deltaY);
    };
    target?.addEventListener("wheel", onWheel, { passive: false });
    return () => target?.removeEventListener("wheel", onWheel);
  }, [viewport]);

  const onPointerDown = (event: PointerEvent): void => {
    if (event.button !== 0) return;
    clearTimeout(stays.current);
    if (event.pointerType === "touch") {
      fingers.current.set(event.pointerId, event);
      if (fingers.current.size > 1) {
        drag.current = null;
        return;
      }
      stays.current = setTimeout(() => {
        measures.pin(pixelAt(event));
        drag.current = null;
      }, 1000 * STAYS_S);
    }
    const kind = event.shiftKey ? "region" : event.ctrlKey || event.metaKey ? "corner" : "pan";
    drag.current = { kind, from: pixelAt(event), last: event, moved: false };
    picture.current?.setPointerCapture(event.pointerId);
  };
  const onPointerMove = (event: PointerEvent): void => {
    moveDrag(event);
    store.pointed.value = pixelAt(event); // after the picture was moved under the pointer
  };
  /** Two fingers: the picture follows their middle, and grows as they part. */
  const pinch = (event: PointerEvent): void => {
    const [[from, before], [to, after]] = [0, 1].map((step) => {
      if (step === 1) fingers.current.set(event.pointerId, event);
      const [a, b] = [...fingers.current.values()];
      const [one, other] = [a, b].map(shareAt);
      return [{ x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 }, Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY)] as const;
    });
    viewport.zoomAt(from, after / before);
    viewport.pan({ x: to.x - from.x, y: to.y - from.y });
  };
  const moveDrag = (event: PointerEvent): void => {
    if (fingers.current.size === 2 && fingers.current.has(event.pointerId)) pinch(event);
    const now = drag.current;
    if (now === null) return;
    now.moved ||= Math.hypot(event.clientX - now.last.clientX, event.clientY - now.last.clientY) > CLICK_PX;
    if (!now.moved) return;
    clearTimeout(stays.current);
    if (now.kind === "region") {
      measures.region.value = regionOf(now.from, pixelAt(event));
    } else if (now.kind === "pan") {
      const [before, after] = [shareAt(now.last), shareAt(event)];
      viewport.pan({ x: after.x - before.x, y: after.y - before.y });
      now.last = event;
    }
  };
  const release = (event: PointerEvent): void => {
    clearTimeout(stays.current);
    fingers.current.delete(event.pointerId);
    drag.current = null;
  };
  const onPointerUp = (event: PointerEvent): void => {
    const ended = drag.current;
    release(event);
    if (ended === null || ended.moved) return;
    if (ended.kind === "region") measures.pin(pixelAt(event));
    else if (ended.kind === "corner") measures.corner(pixelAt(event));
    else store.selected.value = pixelAt(event);
  };

  const onKeyDown = (event: KeyboardEvent): void => {
    const from = store.selected.peek() ?? { x: width >> 1, y: height >> 1 };
    const moved = event.shiftKey ? stepped(from, event.key, width, height) : null;
    const centre: Point = { x: 0.5, y: 0.5 };
    if (moved !== null) store.selected.value = moved;
    else if (event.key === "+") viewport.zoomAt(centre, KEY_ZOOM);
    else if (event.key === "-") viewport.zoomAt(centre, 1 / KEY_ZOOM);
    else if (event.key === "Enter") measures.pin(from);
    else if (event.key === "c" && !event.ctrlKey && !event.metaKey) measures.corner(from);
    else if (event.key === "r") measures.toggleRegion(from, width, height);
    else if (event.key === "Escape") [measures.region.value, measures.pins.value] = [null, []];
    else return;
    event.preventDefault();
    event.stopPropagation();
  };

  const style = useComputedOf([viewport], () => {
    const { zoom, left, top } = viewport.view.value;
    return zoom === 1 ? undefined : { transform: `scale(${zoom}) translate(${-100 * left}%, ${-100 * top}%)` };
  });
  const zoomed = viewport.view.value !== WHOLE;
  const sent = useComputedOf([frame], () => (frame.value === null ? "" : sentWords(frame.value.meta))).value;
  const frameless = useComputedOf([frame], () => frame.value === null).value;
  return (
    <div class="stage" style={{ "--aspect": width / height }}>
      <div
        ref={picture}
        class="stage-picture"
        role="application"
        aria-roledescription="sensor image"
        aria-label={`${label}. Click a pixel, or press Shift and an arrow key, to show its impulse response.`}
        tabIndex={0}
        data-zoomed={zoomed}
        onPointerMove={onPointerMove}
        onPointerLeave={() => (store.pointed.value = null)}
        onPointerDown={onPointerDown}
        onPointerUp={onPointerUp}
        onPointerCancel={release}
        onContextMenu={(event) => fingers.current.size > 0 && event.preventDefault()}
        onDblClick={() => viewport.reset()}
        onKeyDown={onKeyDown}
      >
        <div class="stage-zoom cover" style={style.value}>
          {children}
          {frameless && <FirstFrame />}
        </div>
        <Marks width={width} height={height} />
        {sent !== "" && (
          <span class="stage-sent" title="The other pixels were not sent: they are drawn like those beside them, and have no value">
            {sent}
          </span>
        )}
      </div>
      {zoomed && (
        <button type="button" class="stage-whole" title="Show the whole picture (double click)" onClick={() => viewport.reset()}>
          {Number(viewport.view.value.zoom.toPrecision(2))} ×
        </button>
      )}
    </div>
  );
}

/** In the place of a picture before its first frame: what is waited for. */
export function FirstFrame() {
  const { status, cameraless } = useStore();
  const words = useComputed(() => {
    if (status.connection.value.kind === "refused") return "Pictures are shown to those with a token.";
    if (status.connection.value.kind === "waiting") return "There is no connection to the service.";
    if (cameraless.value) return "No camera is chosen yet.";
    if (status.cameraLoss.value !== null) return "The camera was lost before its first frame.";
    if (status.running.value === false) return "The camera stands still: Start or Single takes a frame.";
    return "Waiting for the first frame";
  });
  return <p class="stage-empty cover">{words}</p>;
}
