import { signal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { createRenderer, hasGraphics } from "../../gl/createRenderer";
import type { DensityRenderer } from "../../gl/renderer";
import type { Coefficients } from "../../physics/maximumEntropy";
import { Poles } from "../../physics/poles";
import { colourTable, levelOf } from "../../scales/colourMaps";
import { toned } from "../../scales/tone";
import { gateStart_rad, NAMES, type TransientLook } from "../../store/lightLook";
import { AMPLITUDE } from "../../store/mapCatalogue";
import { useStore } from "../../store/store";
import { useDrawing } from "../../ui/hooks";
import { draw } from "../../ui/paint";
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
    let made: DensityRenderer;
    try {
      made = createRenderer(canvas.current, attempt.peek() < GRAPHICS_TRIES && hasGraphics());
    } catch (error) {
      if (attempt.peek() >= GRAPHICS_TRIES) throw error;
      attempt.value = GRAPHICS_TRIES;
      return undefined;
    }
    made.onLost(() => (attempt.value += 1));
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

/** Finding poles takes microseconds a pixel: larger pictures are thinned to about this many. */
const MOST_PIXELS = 40_000;

/** The light that has come up to the player's time, or within a gate before it, in closed form. */
export function LightSoFar({ look }: { look: TransientLook }) {
  const store = useStore();
  const frame = store.frames.of("coefficients");
  const scene = store.frames.of(AMPLITUDE);
  const canvas = useRef<HTMLCanvasElement>(null);
  const light = useMemo(() => new GatheredLight(), []);

  useDrawing(() => {
    const coefficients = frame.value?.coefficients;
    const phase_rad = store.player.phase_rad.value;
    // As bright as the still picture would be: at the end of the period it is that picture.
    const white = (scene.value?.map?.high ?? NaN) / 2 ** look.stops.value;
    const [tone, colours] = [look.tone.value, look.colours.value];
    if (!coefficients || canvas.current === null || !(white > 0)) return;
    light.take(coefficients);
    const values = light.between(look.play.value === "gate" ? gateStart_rad(phase_rad, store.period_s.value) : 0, phase_rad);
    draw(canvas.current, light.width, light.height, ({ buffer }) => {
      const table = new Uint32Array(colourTable(colours).buffer);
      const pixels = new Uint32Array(buffer);
      for (let at = 0; at < values.length; at++) {
        const share = values[at] / white;
        pixels[at] = table[levelOf(share >= 0 ? toned(tone, share) : 0)];
      }
    });
    Object.assign(canvas.current.dataset, { frame: frame.peek()?.meta.frame, white, play: look.play.peek() });
    look.snapshot = () => canvas.current;
  }, [frame, look]);

  return (
    <Stage frame={frame} label={NAMES[look.play.value]}>
      <canvas ref={canvas} data-product="transient" data-renderer="closed-form" />
    </Stage>
  );
}

/** Poles of a frame, every `step`-th pixel across and down, found once a frame. */
class GatheredLight {
  width = 0;
  height = 0;
  #poles = new Poles(1, 0);
  #taken: Coefficients | null = null;
  #values = new Float32Array(0);
  #before = new Float32Array(0);

  take(c: Coefficients): void {
    if (c === this.#taken) return;
    this.#taken = c;
    const step = Math.max(1, Math.ceil(Math.sqrt((c.width * c.height) / MOST_PIXELS)));
    this.width = Math.ceil(c.width / step);
    this.height = Math.ceil(c.height / step);
    const area = this.width * this.height;
    if (this.#poles.harmonics !== c.harmonics || this.#poles.area !== area) {
      this.#poles = new Poles(c.harmonics, area);
      this.#values = new Float32Array(area);
      this.#before = new Float32Array(area);
    }
    for (let y = 0, at = 0; y < this.height; y++) {
      for (let x = 0; x < this.width; x++, at++) this.#poles.findOne(c, y * step * c.width + x * step, at);
    }
  }

  /** Light between two times, given as phases, of every pixel. */
  between(from_rad: number, to_rad: number): Float32Array {
    this.#poles.image(to_rad, this.#values);
    if (from_rad === 0) return this.#values;
    this.#poles.image(from_rad, this.#before);
    for (let at = 0; at < this.#values.length; at++) this.#values[at] -= this.#before[at];
    return this.#values;
  }
}
