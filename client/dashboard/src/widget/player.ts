/**
 * Light in flight in a cell of a notebook: the page's side of `transientcam.player`, an anywidget.
 *
 * It draws with the dashboard's own modules. Its model holds one frame of coefficients at a time; a live one is asked
 * for the next frame when this one is drawn, so that a slow notebook gets fewer frames and no queue.
 */
import { computed, effect, signal } from "@preact/signals";

import { createRenderer } from "../gl/createRenderer";
import { rangeOfTime_m } from "../physics/constants";
import type { Coefficients } from "../physics/maximumEntropy";
import { AnimationLoop } from "../store/animation";
import { Player } from "../store/player";
import { summariseLight } from "../stream/summary";
import { timeWords } from "../ui/figure";
import { litOf } from "../views/transient/arrivals";
import STYLE from "./player.css?inline";

/** The part of anywidget's model that is used here. */
export interface Model {
  get(name: string): unknown;
  set(name: string, value: unknown): void;
  save_changes(): void;
  on(event: string, listener: () => void): void;
  off(event: string, listener: () => void): void;
}

/** What the model says of its coefficients. */
type Shape = Readonly<{ frame: number; harmonics: number; width: number; height: number; base_frequency_hz: number }>;

/** The coefficients that a model holds. */
export function coefficientsIn(model: Model): Coefficients {
  const { harmonics, width, height, base_frequency_hz } = model.get("shape") as Shape;
  const bytes = model.get("coefficients") as DataView;
  // A copy: the message's buffer need not be aligned to four bytes.
  const planes = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer);
  return { planes, harmonics, width, height, baseFrequency_hz: base_frequency_hz };
}

function element<K extends keyof HTMLElementTagNameMap>(
  name: K,
  properties: Partial<HTMLElementTagNameMap[K]> = {},
): HTMLElementTagNameMap[K] {
  return Object.assign(document.createElement(name), properties);
}

function slider(label: string, max: number, step: number): HTMLInputElement {
  const made = element("input", { type: "range", min: "0", max: String(max), step: String(step) });
  made.setAttribute("aria-label", label);
  return made;
}

/** Fills a cell; what it returns takes everything back. */
export function render({ model, el }: { readonly model: Model; readonly el: HTMLElement }): () => void {
  const coefficients = signal(coefficientsIn(model));
  const player = new Player(computed(() => 1 / coefficients.value.baseFrequency_hz));
  const light = computed(() => summariseLight(coefficients.value));
  const frames = model.get("count") as number;
  const rate_hz = model.get("rate_hz") as number;

  const canvas = element("canvas");
  const play = element("button", { type: "button" });
  const time = slider("Time of flight", 1, 0.001);
  const readout = element("output");
  const row = element("div");
  row.append(play, time, readout);
  const which = element("div", { className: "frame" });
  const frame = slider("Frame", Math.max(0, frames - 1), 1);
  frame.hidden = frames === 0;
  const number = element("output");
  which.append(number, frame);
  const problem = element("p", { className: "problem" });
  problem.setAttribute("role", "alert");
  const root = element("div", { className: "transientcam-player" });
  root.append(element("style", { textContent: STYLE }), canvas, row, which, problem);
  el.append(root);

  // A browser keeps 16 contexts of WebGL, and a notebook may have more cells than that.
  const renderer = createRenderer(canvas, false);
  const loop = new AnimationLoop((callback) => requestAnimationFrame(callback));
  loop.add((elapsed_s) => player.advance(elapsed_s));

  const seek = (): void => {
    const turn = (model.get("time_s") as number) / player.period_s.peek();
    player.seek(turn - Math.floor(turn));
  };
  const ask = (): void => {
    model.set("wanted", (model.get("wanted") as number) + 1);
    model.save_changes();
  };
  let timer = 0;
  const later = (): void => {
    window.clearTimeout(timer);
    if (rate_hz > 0) timer = window.setTimeout(ask, 1000 / rate_hz);
  };
  const answered = (): void => {
    coefficients.value = coefficientsIn(model);
    number.value = `Frame ${(model.get("shape") as Shape).frame}`;
    problem.textContent = model.get("problem") as string;
    canvas.dataset.frame = String((model.get("shape") as Shape).frame);
    later();
  };

  play.onclick = () => {
    player.toggle();
    loop.wake();
  };
  time.oninput = () => {
    player.playing.value = false;
    player.seek(Number(time.value));
  };
  time.onchange = () => {
    model.set("time_s", player.time_s.peek());
    model.save_changes();
  };
  frame.oninput = () => {
    model.set("index", Number(frame.value));
    ask();
  };
  model.on("change:answered", answered);
  model.on("change:time_s", seek);

  const ends = [
    effect(() => void (player.lit.value = litOf(light.value.arrivals))),
    effect(() => {
      const white = light.value.peak > 0 ? light.value.peak : 1;
      const phase_rad = player.phase_rad.value;
      renderer.draw(coefficients.value, { phase_rad, tone: { kind: "root", white }, colours: "inferno", backdrop: null });
      time.value = String(player.turn.value);
      readout.value = timeWords(player.time_s.value, rangeOfTime_m(player.time_s.value));
    }),
    effect(() => void (play.textContent = player.playing.value ? "Pause" : "Play")),
  ];
  frame.value = String(model.get("index"));
  seek();
  answered();
  return () => {
    window.clearTimeout(timer);
    model.off("change:answered", answered);
    model.off("change:time_s", seek);
    for (const end of ends) end();
    renderer.dispose();
    root.remove();
  };
}

export default { render };
