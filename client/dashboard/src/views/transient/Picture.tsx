import { signal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";

import { createRenderer, hasGraphics } from "../../gl/createRenderer";
import type { DensityRenderer } from "../../gl/renderer";
import type { TransientLook } from "../../store/lightLook";
import { AMPLITUDE } from "../../store/mapCatalogue";
import { useStore } from "../../store/store";
import { useDrawing } from "../../ui/hooks";
import { Stage } from "../../ui/Stage";
import { backdropOf } from "./LightBar";

/** Tries of WebGL2 before the page is content with typed arrays. */
const GRAPHICS_TRIES = 2;

/** The picture of the light at the player's time. */
export function Picture({ look }: { look: TransientLook }) {
  const store = useStore();
  const frame = store.frames.of("coefficients");
  const scene = store.frames.of(AMPLITUDE);
  const canvas = useRef<HTMLCanvasElement>(null);
  const renderer = useMemo(() => signal<DensityRenderer | null>(null), []);
  const attempt = useMemo(() => signal(0), []);

  // A canvas keeps the kind of its context, and a lost one stays lost: each attempt gets a new canvas.
  useEffect(() => {
    if (canvas.current === null) return undefined;
    const tryAgain = (): void => {
      attempt.value += 1;
    };
    let made: DensityRenderer;
    try {
      made = createRenderer(canvas.current, attempt.peek() < GRAPHICS_TRIES && hasGraphics());
    } catch (error) {
      if (attempt.peek() >= GRAPHICS_TRIES) throw error;
      attempt.value = GRAPHICS_TRIES;
      return undefined;
    }
    made.onLost(tryAgain);
    renderer.value = made;
    canvas.current.dataset.renderer = made.kind;
    return () => {
      renderer.value = null;
      made.dispose();
    };
  }, [attempt.value]);

  const draw = (): void => {
    const coefficients = frame.value?.coefficients ?? null;
    const brightness = scene.value;
    const phase_rad = store.player.phase_rad.value;
    const tone = look.toneNow;
    const colours = look.colours.value;
    const scenery = backdropOf(brightness, look);
    if (renderer.value === null || coefficients === null) return;
    const backdrop = brightness?.values.length === coefficients.width * coefficients.height ? scenery : null;
    renderer.value.draw(coefficients, { phase_rad, tone, colours, backdrop });
    if (canvas.current !== null) canvas.current.dataset.frame = String(frame.peek()?.meta.frame);
    look.snapshot = () => {
      draw();
      return canvas.current;
    };
  };
  useDrawing(draw, [renderer, look]);

  return (
    <Stage frame={frame} label="Light in flight">
      <canvas key={attempt.value} ref={canvas} data-product="transient" />
    </Stage>
  );
}
