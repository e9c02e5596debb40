/** How each map is shown, wherever it is: as a picture, as points, on its colour bar. */
import { computed, type ReadonlySignal, type Signal, signal } from "@preact/signals";

import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import { autoLimits, type Scale, type ScaleKind, type Span, symmetric } from "../scales/scale";
import type { Frame, Frames } from "./frames";
import { MAP_PRODUCTS, type MapProduct } from "./mapCatalogue";
import { mapFrame } from "./mapFrames";
import type { Noises } from "./noise";
import { oneOf, remembered, type Shelf } from "./settings";

/** Where the ends of a scale stand before anything was measured. */
const EMPTY: Span = { low: 0, high: 1 };

/** What of a look is set by hand; travels in a link. */
export interface LookChoice {
  readonly colours: ColourMapName;
  readonly kind: ScaleKind;
  /** Null while the limits follow the data. */
  readonly limits: Span | null;
}

/** How one map is shown: its colours, its scale, and limits that follow the data or were set. */
export class Look {
  readonly colours: Signal<ColourMapName>;
  readonly kind: Signal<ScaleKind>;
  /** Limits set by hand; null while they follow the data. */
  readonly manual: Signal<Span | null>;
  readonly scale: ReadonlySignal<Scale>;
  #followed: Span | null = null;
  #last: Scale = { ...EMPTY, kind: "linear" };

  constructor(
    readonly product: MapProduct,
    readonly frame: ReadonlySignal<Frame | null>,
    shelf: Shelf | null,
  ) {
    const key = (what: string): string => `map.${product.product}.${what}`;
    this.colours = remembered(shelf, key("colours"), product.colours, oneOf(COLOUR_MAPS));
    this.kind = remembered(shelf, key("scale"), product.scale, oneOf<ScaleKind>(["linear", "logarithmic"]));
    this.manual = remembered<Span | null>(shelf, key("limits"), null, isLimits);
    this.scale = computed(() => {
      const { low, high } = this.manual.value ?? this.#follow(frame.value?.map ?? null);
      const kind = this.kind.value;
      const last = this.#last;
      // The same scale is the same value, so that a new frame alone does not draw the bar again.
      if (last.low !== low || last.high !== high || last.kind !== kind) this.#last = { low, high, kind };
      return this.#last;
    });
  }

  get choice(): LookChoice {
    return { colours: this.colours.peek(), kind: this.kind.peek(), limits: this.manual.peek() };
  }

  set choice({ colours, kind, limits }: LookChoice) {
    this.colours.value = colours;
    this.kind.value = kind;
    this.manual.value = limits;
  }

  /** Whether anything was chosen that the map does not begin with. */
  get chosen(): boolean {
    return this.manual.peek() !== null || this.colours.peek() !== this.product.colours || this.kind.peek() !== this.product.scale;
  }

  #follow(span: Span | null): Span {
    if (span !== null) this.#followed = autoLimits(this.#followed, this.product.signed ? symmetric(span) : span);
    return this.#followed ?? EMPTY;
  }
}

/** The looks of all maps, and which of them share their limits. */
export class Looks {
  /** Maps of one unit keep the same limits, so that they can be compared. */
  readonly locked: Signal<boolean>;
  readonly #all: ReadonlyMap<string, Look>;

  constructor(frames: Frames, noises: Noises, shelf: Shelf | null) {
    this.#all = new Map(MAP_PRODUCTS.map((shown) => [shown.product, new Look(shown, mapFrame(frames, noises, shown), shelf)]));
    this.locked = signal(false);
  }

  of(product: string): Look {
    const look = this.#all.get(product);
    if (look === undefined) throw new Error(`There is no map of ${product}.`);
    return look;
  }

  /** Sets the limits of a map by hand, null to let them follow the data; of all maps of its unit while these are locked. */
  limit(look: Look, limits: Span | null): void {
    for (const each of this.locked.peek() ? this.#kin(look) : [look]) each.manual.value = limits;
  }

  /** Gives all maps of a map's unit its limits from now on, or lets each have its own again. */
  lock(look: Look, locked: boolean): void {
    const { low, high } = look.scale.peek();
    for (const each of this.#kin(look)) each.manual.value = locked ? { low, high } : null;
    this.locked.value = locked;
  }

  /** All looks by the names of their products. */
  get all(): ReadonlyMap<string, Look> {
    return this.#all;
  }

  #kin({ product: { unit } }: Look): Look[] {
    return [...this.#all.values()].filter(({ product }) => product.unit === unit);
  }
}

export function isLimits(value: unknown): value is Span | null {
  if (value === null) return true;
  const { low, high } = (value ?? {}) as Partial<Span>;
  return typeof low === "number" && typeof high === "number" && high > low;
}
