import type { ComponentType } from "preact";

import { MapView } from "./map/MapView";
import { ResponseView } from "./response/ResponseView";
import { SequenceView } from "./sequence/SequenceView";
import { TransientView } from "./transient/TransientView";

/**
 * The views of the page, in reading order. A view is a component that takes no properties: it reads the
 * store, and asks it for the products that it shows. Its place in the layout is a grid area of its name.
 */
export const VIEWS: readonly { readonly name: string; readonly view: ComponentType }[] = [
  { name: "map", view: MapView },
  { name: "transient", view: TransientView },
  { name: "response", view: ResponseView },
  { name: "sequence", view: SequenceView },
];
