import { effect, type Signal, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";

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

/** Has products streamed for as long as the view stands. */
export function useProducts(products: readonly string[]): void {
  const { frames } = useStore();
  useEffect(() => frames.claim(products), [frames, products.join()]);
}

/** A signal that is set from an element's size. */
export function useSize(target: { readonly current: Element | null }, size: Signal<{ width: number; height: number }>): void {
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
