import type { ColourMapName } from "../scales/colourMaps";
import type { ScaleKind } from "../scales/scale";

/** A map of one number a pixel, and how it is shown unless the user chose otherwise. */
export interface MapProduct {
  readonly product: string;
  readonly name: string;
  readonly hint: string;
  readonly unit: string;
  readonly colours: ColourMapName;
  /** Linear where it is absent. */
  readonly scale?: ScaleKind;
  readonly decimals: number;
  /** Zero means something: limits lie evenly around it. */
  readonly signed?: boolean;
}

/** The maps of this project, in the order of their tabs. */
export const MAP_PRODUCTS: readonly MapProduct[] = [
  { product: "range", name: "Range", hint: "Distance to what the first light came from", unit: "m", colours: "viridis", decimals: 3 },
  { product: "direct", name: "Direct", hint: "Light of the first return", unit: "DN", colours: "grey", decimals: 1 },
  { product: "indirect", name: "Indirect", hint: "Light that took a longer way", unit: "DN", colours: "grey", decimals: 1 },
  { product: "brightness", name: "Brightness", hint: "All light: the zeroth moment", unit: "DN", colours: "grey", decimals: 1 },
  {
    product: "validity",
    name: "Validity",
    hint: "Smallest eigenvalue of the moments over b₀; below zero no light could have made them",
    unit: "1",
    colours: "coolwarm",
    decimals: 4,
    signed: true,
  },
  {
    product: "range_error",
    name: "Error",
    hint: "Half of the 90 % interval of each pixel's range, of noise and bias",
    unit: "m",
    colours: "cividis",
    scale: "logarithmic",
    decimals: 4,
  },
];

/** The map of another package's product, by what the service says of it. */
export function mapOf(product: string, unit: string, hint: string): MapProduct {
  const name = product.replace(/[-_]/g, " ").replace(/^./, (first) => first.toUpperCase());
  return { product, name, hint, unit, colours: "viridis", decimals: 3 };
}

/** The map of A - B where two frames are compared. */
export function differenceMap({ scale, ...map }: MapProduct): MapProduct {
  return { ...map, product: `${map.product}-difference`, name: `${map.name}, A − B`, colours: "coolwarm", signed: true };
}

/** What the hover line says beside the map's own value. */
export const AMPLITUDE = "brightness";
