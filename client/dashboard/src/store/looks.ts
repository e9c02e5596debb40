/** How each map is shown, wherever it is: as a picture, as points, on its colour bar. */
import { computed, effect, type ReadonlySignal, type Signal, signal } from "@preact/signals";

import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import { autoLimits, joined, type Scale, type ScaleKind, type Span, symmetric } from "../scales/scale";
import type { Comparison } from "./comparison";
import type { Frame, Frames } from "./frames";
import { differenceMap, type MapProduct } from "./mapCatalogue";
import { type Kind, oneOf, type Setting, type Settings } from "./settings";

/** Where the ends of a scale stand before anything was measured. */
const EMPTY: Span = { low: 0, high: 1 };

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
    settings: Settings,
    /** What has the same limits. */
    beside: ReadonlySignal<Frame | null> = signal(null),
  ) {
    const key = (what: string): string => `map.${product.product}.${what}`;
    const colours: Setting<ColourMapName> = { key: key("colours"), initial: product.colours, ...oneOf(COLOUR_MAPS) };
    const kind: Setting<ScaleKind> = { key: key("scale"), initial: product.scale ?? "linear", ...oneOf(["linear", "logarithmic"]) };
    const manual: Setting<Span | null> = { key: key("limits"), initial: null, ...LIMITS };
    settings.together("look", [colours, kind, manual], { of: product.product });
    [this.colours, this.kind, this.manual] = [settings.of(colours), settings.of(kind), settings.of(manual)];
    this.scale = computed(() => {
      const { low, high } = this.manual.value ?? this.#follow(joined(frame.value?.map ?? null, beside.value?.map ?? null));
      const kind = this.kind.value;
      const last = this.#last;
      // The same scale is the same value, so that a new frame alone does not draw the bar again.
      if (last.low !== low || last.high !== high || last.kind !== kind) this.#last = { low, high, kind };
      return this.#last;
    });
  }

  #follow(span: Span | null): Span {
    if (span !== null) this.#followed = autoLimits(this.#followed, this.product.signed ? symmetric(span) : span);
    return this.#followed ?? EMPTY;
  }
}

/** The looks of all maps, and which of them share their limits. */
export class Looks {
  /** Maps of one unit keep the same limits, so that they can be compared. */
  readonly locked = signal(false);
  readonly #all = new Map<string, Look>();

  constructor(
    private readonly frames: Frames,
    settings: Settings,
    comparison: Comparison,
  ) {
    effect(() => {
      const added = frames.maps.value.filter(({ product }) => !this.#all.has(product));
      for (const map of added) {
        const { b, difference } = comparison.of(map.product);
        const looks = [new Look(map, frames.of(map.product), settings, b), new Look(differenceMap(map), difference, settings)];
        for (const look of looks) this.#all.set(look.product.product, look);
      }
    });
  }

  /** The look of a map, or of the first where there is none. */
  of(product: string): Look {
    return this.#all.get(product) ?? (this.#all.get(this.frames.maps.value[0].product) as Look);
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

  #kin({ product: { unit, signed } }: Look): Look[] {
    return [...this.#all.values()].filter(({ product }) => product.unit === unit && product.signed === signed);
  }
}

/** As "1,3.5". */
const LIMITS: Kind<Span | null> = {
  accepts: isLimits,
  text: (limits) => (limits === null ? "" : [limits.low, limits.high].map((end) => Number(end.toPrecision(6))).join()),
  parse: (text) => {
    const [low, high, ...more] = text.split(",").map(Number);
    const limits = text === "" ? null : { low, high };
    return isLimits(limits) && more.length === 0 ? limits : undefined;
  },
};

function isLimits(value: unknown): value is Span | null {
  if (value === null) return true;
  const { low, high } = (value ?? {}) as Partial<Span>;
  return typeof low === "number" && typeof high === "number" && high > low;
}
