import { computed, effect, type ReadonlySignal, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";

import type { Frame } from "../store/frames";
import { useStore } from "../store/store";

/**
 * Runs `draw` now and whenever a signal it read changes. For canvases: no component renders again, and as
 * the animation loop changes signals in one batch, a picture is drawn at most once a refresh.
 */
export function useDrawing(draw: () => void, inputs: readonly unknown[]): void {
  const latest = useRef(draw);
  latest.current = draw;
  useEffect(() => effect(() => latest.current()), inputs);
}

/** What `compute` makes of signals, computed anew also when an input changes that is none. */
export function useComputedOf<T>(inputs: readonly unknown[], compute: () => T): ReadonlySignal<T> {
  return useMemo(() => computed(compute), inputs);
}

/** Width and height of a frame's picture in pixels of the sensor; the paper's sensor's before the first frame. */
export function usePictureSize(frame: ReadonlySignal<Frame | null>): readonly [width: number, height: number] {
  const size = useComputedOf([frame], () => (frame.value?.shape.slice(-2) ?? [120, 163]).join());
  const [height, width] = size.value.split(",").map(Number);
  return [width, height];
}

/** Has products streamed for as long as the view stands. */
export function useProducts(products: readonly string[]): void {
  const { frames } = useStore();
  useEffect(() => frames.claim(products), [frames, products.join()]);
}

/** The size of an element in px; of one that is not there yet, zero. */
export function useSize(target: { readonly current: Element | null }): ReadonlySignal<{ readonly width: number; readonly height: number }> {
  const size = useSignal({ width: 0, height: 0 });
  useEffect(() => {
    const element = target.current;
    if (element === null) return undefined;
    const observer = new ResizeObserver(([entry]) => {
      const { width, height } = entry.contentRect;
      size.value = { width: Math.round(width), height: Math.round(height) };
    });
    observer.observe(element);
    return () => observer.disconnect();
  }, [target, size]);
  return size;
}

/** The time of the page's clock in s, as often as is asked for. */
export function useNow(every_s: number): number {
  const now_s = useSignal(Date.now() / 1000);
  useEffect(() => {
    const timer = setInterval(() => (now_s.value = Date.now() / 1000), 1000 * every_s);
    return () => clearInterval(timer);
  }, [now_s, every_s]);
  return now_s.value;
}
