import type { ColourMapName } from "../scales/colourMaps";
import type { ScaleKind } from "../scales/scale";
import maps from "./maps.json";

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
export const MAP_PRODUCTS = maps as readonly MapProduct[];

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
