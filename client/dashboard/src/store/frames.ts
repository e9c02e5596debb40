import { signal, type Signal } from "@preact/signals";

import type { Coefficients } from "../physics/maximumEntropy";
import type { FrameMeta, Numbers } from "../stream/protocol";
import { coefficientsOf, type FrameReport, type LightSummary, type MapSummary } from "../stream/summary";
import { LIVE } from "./api";

/** The newest frame of one product. */
export interface Frame {
  /** Where the service has the frame: as its newest, or in a recording. */
  readonly origin: string;
  readonly product: string;
  readonly unit: string;
  readonly meta: FrameMeta;
  readonly shape: readonly number[];
  readonly values: Numbers;
  readonly map: MapSummary | null;
  readonly light: LightSummary | null;
  /** The same values as coefficients of Eq. (2), where they are that. */
  readonly coefficients: Coefficients | null;
}

/**
 * The newest frame of each product, and which products are wanted.
 *
 * Views ask for products and give them back; what any view asks for is streamed. At most one frame
 * of a product is kept, so memory does not grow with time.
 */
export class Frames {
  /** Products that a view shows, sorted. */
  readonly wanted = signal<readonly string[]>([]);
  readonly #claims = new Map<string, number>();
  readonly #newest = new Map<string, Signal<Frame | null>>();

  /** The newest frame of a product; null until one arrived. */
  of(product: string): Signal<Frame | null> {
    let newest = this.#newest.get(product);
    if (newest === undefined) {
      newest = signal<Frame | null>(null);
      this.#newest.set(product, newest);
    }
    return newest;
  }

  /** Asks for products; the answer gives them back. */
  claim(products: readonly string[]): () => void {
    for (const product of products) this.#claims.set(product, (this.#claims.get(product) ?? 0) + 1);
    this.#publish();
    return () => {
      for (const product of products) {
        const left = (this.#claims.get(product) ?? 0) - 1;
        if (left > 0) this.#claims.set(product, left);
        else this.#release(product);
      }
      this.#publish();
    };
  }

  put(frame: Frame): void {
    if (this.#claims.has(frame.product)) this.of(frame.product).value = frame;
  }

  #release(product: string): void {
    this.#claims.delete(product);
    const newest = this.#newest.get(product);
    if (newest !== undefined) newest.value = null; // its memory, and no view shows an old picture later
  }

  #publish(): void {
    const wanted = [...this.#claims.keys()].sort();
    if (wanted.join() !== this.wanted.peek().join()) this.wanted.value = wanted;
  }
}

/** A frame as views see it. */
export function frameOf({ message, map, light }: FrameReport, origin: string = LIVE): Frame {
  const { product, unit, meta, array } = message;
  const coefficients = product === "coefficients" ? coefficientsOf(message) : null;
  return { origin, product, unit, meta, shape: array.shape, values: array.data, map, light, coefficients };
}
