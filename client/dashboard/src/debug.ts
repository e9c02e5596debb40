/** What tests and measurements reach the page by; loaded only where the address asks for `?debug`. */
import { createRenderer, hasGraphics } from "./gl/createRenderer";
import type { DensityRenderer } from "./gl/renderer";
import type { Coefficients } from "./physics/maximumEntropy";
import { frameOf } from "./store/frames";
import { LAYOUTS } from "./store/layout";
import type { Store } from "./store/store";
import { VIEW_NAMES } from "./store/viewNames";
import { decodeMessage, type FrameMessage } from "./stream/protocol";
import { coefficientsOf, summarised } from "./stream/summary";

/** A density read back from the renderer that the page's own pictures are made with. */
type Reading = Readonly<{ renderer: string; values: number[] }>;

class Bench {
  #renderer: DensityRenderer | null = null;

  /** What there is to show. */
  readonly views = VIEW_NAMES;
  readonly layouts = Object.keys(LAYOUTS);

  constructor(readonly store: Store) {}

  /** Shows a layout, or one view alone. */
  arrange(layout: string, view: string): void {
    this.store.showLayout(LAYOUTS[layout]);
    if (view !== "") this.store.alone.value = view;
  }

  /** Shows a frame message as if it had been streamed. */
  show(body: ArrayBuffer): void {
    this.store.frames.put(frameOf(summarised(frameMessage(body))));
  }

  /** Density of every pixel of a frame of coefficients. */
  density(body: ArrayBuffer, phase_rad: number): Reading {
    return this.#read(coefficientsOf(frameMessage(body)), phase_rad);
  }

  /** The same for the frame on screen. */
  shownDensity(phase_rad: number): Reading {
    return this.#read(this.store.frames.of("coefficients").peek()?.coefficients ?? null, phase_rad);
  }

  #read(coefficients: Coefficients | null, phase_rad: number): Reading {
    if (coefficients === null) throw new Error("There are no coefficients.");
    this.#renderer ??= createRenderer(document.createElement("canvas"), hasGraphics());
    return { renderer: this.#renderer.kind, values: [...this.#renderer.readDensity(coefficients, phase_rad)] };
  }
}

function frameMessage(body: ArrayBuffer): FrameMessage {
  const message = decodeMessage(body);
  if (message?.type !== "frame") throw new Error("That is no frame.");
  return message;
}

export function expose(store: Store): void {
  Object.assign(window, { transientcam: new Bench(store) });
}
