/** What tests and measurements reach the page by; loaded only where the address asks for `?debug`. */
import { createRenderer, type DensityRenderer } from "./gl/renderer";
import type { Coefficients } from "./physics/maximumEntropy";
import { decodeMessage } from "./stream/protocol";
import { coefficientsOf } from "./stream/summary";
import type { Store } from "./store/store";
import type { StreamClient } from "./stream/client";

/** Reads the density of a frame back from a renderer, as the page's own pictures are made. */
class Bench {
  readonly store: Store;
  readonly #stream: StreamClient;
  #renderer: DensityRenderer | null = null;

  constructor(store: Store, stream: StreamClient) {
    this.store = store;
    this.#stream = stream;
  }

  /** Hands the body of a frame message to the page as if it had come over HTTP. */
  show(body: ArrayBuffer): void {
    this.#stream.decode(body);
  }

  /** Density of every pixel of a frame message, and what computed it. */
  density(body: ArrayBuffer, phase_rad: number): { renderer: string; values: number[] } {
    const message = decodeMessage(body);
    const coefficients = message?.type === "frame" ? coefficientsOf(message) : null;
    if (coefficients === null) throw new Error("That is no frame of coefficients.");
    return this.#read(coefficients, phase_rad);
  }

  /** The same for the frame on screen. */
  shownDensity(phase_rad: number): { renderer: string; values: number[] } {
    const coefficients = this.store.frames.of("coefficients").peek()?.coefficients;
    if (!coefficients) throw new Error("No coefficients are on screen.");
    return this.#read(coefficients, phase_rad);
  }

  #read(coefficients: Coefficients, phase_rad: number): { renderer: string; values: number[] } {
    this.#renderer ??= createRenderer(document.createElement("canvas"), true);
    const values = [...this.#renderer.readDensity(coefficients, phase_rad)];
    return { renderer: this.#renderer.kind, values };
  }
}

export function expose(store: Store, stream: StreamClient): void {
  Object.assign(window, { transientcam: new Bench(store, stream) });
}
