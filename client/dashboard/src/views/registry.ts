import type { ComponentType } from "preact";
import type { ViewName } from "../store/viewNames";
import { later } from "./later";
import { MapView, SecondMapView } from "./map/MapView";
import { ResponseView } from "./response/ResponseView";
import { SequenceView } from "./sequence/SequenceView";
import { TransientView } from "./transient/TransientView";
import words from "./words.json";

interface View {
  readonly name: ViewName;
  readonly title: string;
  readonly view: ComponentType;
  /** The product without which it shows nothing. */
  readonly needs?: string;
}

/**
 * The views on offer. A view is a component that takes no properties: it reads the store, and asks it for
 * the products that it shows. Panels choose among them by name; `layout.ts` says where they stand.
 */
export const VIEWS: readonly View[] = [
  { name: "map", title: "Maps", view: MapView },
  { name: "second-map", title: "Second map", view: SecondMapView },
  { name: "transient", title: "Light in flight", view: TransientView, needs: "coefficients" },
  { name: "response", title: "Impulse response", view: ResponseView },
  { name: "plots", title: "Values", view: later(() => import("./plots/PlotsView")) },
  { name: "streak", title: "Streak", view: later(() => import("./streak/StreakView")), needs: "coefficients" },
  { name: "points", title: "Points in space", view: later(() => import("./points/PointsView")) },
  { name: "validity", title: "Validity", view: later(() => import("./validity/ValidityView")) },
  { name: "sequence", title: "Sequence and accuracy", view: SequenceView },
  { name: "series", title: "Series", view: later(() => import("./series/SeriesView")) },
  { name: "recordings", title: "Recordings", view: later(() => import("./recordings/RecordingsView")) },
  { name: "reconstruction", title: "Reconstruction", view: later(() => import("./reconstruction/ReconstructionView")) },
  { name: "calibration", title: "Calibration", view: later(() => import("./calibration/CalibrationView")) },
  { name: "simulation", title: "Simulated scene", view: later(() => import("./simulation/SimulationView")) },
  { name: "events", title: "What happened", view: later(() => import("./events/EventsView")) },
];

/** What each shows, with the words that people search for. */
export const WORDS: Readonly<Record<ViewName, string>> = words;
