import { computed, type Signal, signal } from "@preact/signals";

import type { Coefficients } from "../physics/maximumEntropy";
import type { Span } from "../scales/scale";
import { type Cut, has, type Numbers, spread } from "../stream/compact";
import type { FrameDocument, FrameMeta } from "../stream/documents";
import { coefficientsOf, type FrameReport, type LightSummary } from "../stream/summary";
import { LIVE } from "./api";
import { MAP_PRODUCTS } from "./mapCatalogue";
import type { Pixel } from "./pixel";

/** The newest frame of one product. */
export interface Frame {
  /** Where the service has the frame: as its newest, or in a recording. */
  readonly origin: string;
  readonly product: string;
  readonly unit: string;
  readonly meta: FrameMeta;
  readonly shape: readonly number[];
  readonly values: Numbers;
  /** Where most of the values of a map lie. */
  readonly map: Span | null;
  readonly light: LightSummary | null;
  /** The same values as coefficients of Eq. (2), where they are that. */
  readonly coefficients: Coefficients | null;
}

/**
 * The newest frame of each product, which products are wanted, and which the camera does not have.
 *
 * Views ask for products and give them back; what any view asks for is streamed. At most one frame
 * of a product is kept, so memory does not grow with time.
 */
export class Frames {
  /** Why frames of this camera do not have a product, by its name. */
  readonly absent = signal<Readonly<Record<string, string | undefined>>>({});
  /** The maps on offer: ours, and those of other packages. */
  readonly maps = signal(MAP_PRODUCTS);
  /** Products that a view shows and that can be had, sorted. */
  readonly wanted = computed(() => this.#claimed.value.filter((product) => this.absent.value[product] === undefined));
  /** The product that says how much light a pixel has. */
  readonly amplitude = computed(() => (this.absent.value.brightness === undefined ? "brightness" : "direct"));
  readonly #claimed = signal<readonly string[]>([]);
  readonly #claims = new Map<string, number>();
  readonly #newest = new Map<string, Signal<Frame | null>>();

  /** Since when the camera stands before its scene, by the service's clock; 0 where that is not known. */
  sceneSince_s = 0;

  /** A name of the scene that a frame is of: what is measured over frames begins anew with another one. */
  sceneOf({ host_time_s, capture_s }: FrameDocument): string {
    return `${host_time_s - capture_s < this.sceneSince_s ? "before" : "since"} ${this.sceneSince_s}`;
  }

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
    if (wanted.join() !== this.#claimed.peek().join()) this.#claimed.value = wanted;
  }
}

/** Whether the service sent this pixel of a frame: where it did not, nothing is known of it. */
export function wasSent(frame: Frame, { x, y }: Pixel): boolean {
  return has(cutOf(frame), x, y);
}

/** Whether the service sent all pixels of a frame. */
export function isWhole({ region, decimation, width, height }: FrameMeta): boolean {
  return decimation === 1 && region[2] === width && region[3] === height;
}

/** Which pixels of a frame the service sent, in words; "" for all. */
export function sentWords(meta: FrameMeta): string {
  if (isWhole(meta)) return "";
  return meta.decimation > 1 ? THINNED : "what was in sight";
}

/** Pixels are left out in both directions. */
export const THINNED = "every 2nd pixel";

/** Values of a map as they are drawn: pixels that were not sent like those beside them. */
export function drawnOf(frame: Frame): Numbers {
  const { values, shape } = frame;
  let drawn = DRAWN.get(values);
  if (drawn === undefined) {
    drawn = spread(values, cutOf(frame), shape[1]);
    DRAWN.set(values, drawn);
  }
  return drawn;
}

/** The values of a map that were sent. */
export function sentOf(frame: Frame): Numbers {
  const { values, shape } = frame;
  const cut = cutOf(frame);
  return values.filter((_: number, at: number) => has(cut, at % shape[1], Math.floor(at / shape[1])));
}

const DRAWN = new WeakMap<Numbers, Numbers>();

function cutOf({ meta, shape }: Frame): Cut {
  const [height, width] = shape.slice(-2);
  const { region = [0, 0, width, height], decimation = 1 }: Partial<FrameMeta> = meta;
  return { region: region as unknown as Cut["region"], decimation };
}

/** A frame as views see it. */
export function frameOf({ message, map, light }: FrameReport, origin: string = LIVE): Frame {
  const { product, unit, meta, array } = message;
  const coefficients = product === "coefficients" ? coefficientsOf(message) : null;
  return { origin, product, unit, meta, shape: array.shape, values: array.data, map, light, coefficients };
}
