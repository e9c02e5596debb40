import type { ComponentType } from "preact";
import type { ViewName } from "../store/viewNames";
import { CalibrationView } from "./calibration/CalibrationView";
import { EventsView } from "./events/EventsView";
import { MapView, SecondMapView } from "./map/MapView";
import { PlotsView } from "./plots/PlotsView";
import { PointsView } from "./points/PointsView";
import { ReconstructionView } from "./reconstruction/ReconstructionView";
import { RecordingsView } from "./recordings/RecordingsView";
import { ResponseView } from "./response/ResponseView";
import { SequenceView } from "./sequence/SequenceView";
import { SimulationView } from "./simulation/SimulationView";
import { StreakView } from "./streak/StreakView";
import { TransientView } from "./transient/TransientView";
import { ValidityView } from "./validity/ValidityView";

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
  { name: "plots", title: "Values", view: PlotsView },
  { name: "streak", title: "Streak", view: StreakView, needs: "coefficients" },
  { name: "points", title: "Points in space", view: PointsView },
  { name: "validity", title: "Validity", view: ValidityView },
  { name: "sequence", title: "Sequence and accuracy", view: SequenceView },
  { name: "recordings", title: "Recordings", view: RecordingsView },
  { name: "reconstruction", title: "Reconstruction", view: ReconstructionView },
  { name: "calibration", title: "Calibration", view: CalibrationView },
  { name: "simulation", title: "Simulated scene", view: SimulationView },
  { name: "events", title: "What happened", view: EventsView },
];
