import { computed, type ReadonlySignal, type Signal } from "@preact/signals";

import type { Frame } from "../../store/frames";
import { oneOf, remembered, type Shelf } from "../../store/settings";
import { COLOUR_MAPS, type ColourMapName } from "../../ui/colourMaps";
import { autoLimits, type Scale, type ScaleKind, type Span } from "../../ui/scale";
import type { MapProduct } from "./catalogue";

/** Where the ends of a scale stand before anything was measured. */
const EMPTY: Span = { low: 0, high: 1 };

/** How one map is shown: its colours, its scale, and limits that follow the data or were set. */
export class MapLook {
  readonly colours: Signal<ColourMapName>;
  readonly kind: Signal<ScaleKind>;
  /** Limits set by hand; null while they follow the data. */
  readonly manual: Signal<Span | null>;
  readonly scale: ReadonlySignal<Scale>;
  #followed: Span | null = null;
  #last: Scale = { ...EMPTY, kind: "linear" };

  constructor(product: MapProduct, frame: ReadonlySignal<Frame | null>, shelf: Shelf | null) {
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

  #follow(span: Span | null): Span {
    if (span !== null) this.#followed = autoLimits(this.#followed, span);
    return this.#followed ?? EMPTY;
  }
}

function isLimits(value: unknown): value is Span | null {
  if (value === null) return true;
  const { low, high } = (value ?? {}) as Partial<Span>;
  return typeof low === "number" && typeof high === "number" && high > low;
}
