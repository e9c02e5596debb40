import { useComputed } from "@preact/signals";
import { useMemo, useRef } from "preact/hooks";
import type { Coefficients } from "../../physics/maximumEntropy";
import { Poles } from "../../physics/poles";
import { colourTable, levelOf } from "../../scales/colourMaps";
import { toned } from "../../scales/tone";
import { gateStart_rad, NAMES, type TransientLook } from "../../store/lightLook";
import { AMPLITUDE } from "../../store/mapCatalogue";
import { useStore } from "../../store/store";
import { FirstFrame } from "../../ui/FirstFrame";
import { useDrawing } from "../../ui/hooks";
import { Stage } from "../../ui/Stage";

/** Finding poles takes microseconds a pixel: larger pictures are thinned to about this many. */
const MOST_PIXELS = 40_000;

/** The light that has come up to the player's time, or within a gate before it, in closed form. */
export function LightSoFar({ look }: { look: TransientLook }) {
  const store = useStore();
  const frame = store.frames.of("coefficients");
  const scene = store.frames.of(AMPLITUDE);
  const canvas = useRef<HTMLCanvasElement>(null);
  const light = useMemo(() => new GatheredLight(), []);
  const size = useComputed(() => `${frame.value?.coefficients?.width ?? 163}x${frame.value?.coefficients?.height ?? 120}`);
  const [width, height] = size.value.split("x").map(Number);

  useDrawing(() => {
    const coefficients = frame.value?.coefficients;
    const phase_rad = store.player.phase_rad.value;
    // As bright as the still picture would be: at the end of the period it is that picture.
    const white = (scene.value?.map?.high ?? NaN) / 2 ** look.stops.value;
    const [tone, colours] = [look.tone.value, look.colours.value];
    const context = canvas.current?.getContext("2d");
    if (!coefficients || canvas.current === null || !context || !(white > 0)) return;
    light.take(coefficients);
    const values = light.between(look.play.value === "gate" ? gateStart_rad(phase_rad, store.period_s.value) : 0, phase_rad);
    if (canvas.current.width !== light.width || canvas.current.height !== light.height)
      [canvas.current.width, canvas.current.height] = [light.width, light.height];
    const image = context.createImageData(light.width, light.height);
    const table = new Uint32Array(colourTable(colours).buffer);
    const pixels = new Uint32Array(image.data.buffer);
    for (let at = 0; at < values.length; at++) {
      const share = values[at] / white;
      pixels[at] = table[levelOf(share >= 0 ? toned(tone, share) : 0)];
    }
    context.putImageData(image, 0, 0);
    Object.assign(canvas.current.dataset, { frame: frame.peek()?.meta.frame, white, play: look.play.peek() });
    look.snapshot = () => canvas.current;
  }, [frame, look]);

  return (
    <Stage width={width} height={height} frame={frame} label={NAMES[look.play.value]}>
      <canvas ref={canvas} data-product="transient" data-renderer="closed-form" />
      {useComputed(() => frame.value === null).value && <FirstFrame />}
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
