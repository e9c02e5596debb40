import type { ComponentType } from "preact";
import type { ViewName } from "../store/viewNames";
import { later } from "./later";
import { MapView, SecondMapView } from "./map/MapView";
import { ResponseView } from "./response/ResponseView";
import { SequenceView } from "./sequence/SequenceView";
import { TransientView } from "./transient/TransientView";

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
export const WORDS: Readonly<Record<ViewName, string>> = {
  map: "One number a pixel: range (distance, depth), direct and indirect light, brightness, errors. Compare shows the difference to a kept frame or a recording; Shift + drag measures a region (roi) with its histogram.",
  "second-map": "Another map beside the first: direct beside indirect, say.",
  transient: "Which pixels light reaches at one time of flight: as it comes, what came in the last nanosecond, or all so far.",
  response: "The light of the selected pixel over time, with bounds, its returns, and the error of its range.",
  plots: "Values over time (chart) at the selected pixel and the pins, in a region (roi), and along a line (profile).",
  streak: "Light over time along one row of pixels, as a streak camera shows it.",
  points: "The ranges as a cloud of points in 3D: turn it, and measure the distance between pins.",
  validity: "Which pixels have no value (invalid, mask, flags), which not to trust, and why.",
  sequence: "Exposure, frequency and takes; how accurate ranges are, and what more accuracy costs in time (plan).",
  series: "Frames at several settings compared in a table: noise, bias, time, accuracy (csv).",
  recordings: "Frames kept on the service: record, replay, export and download (hdf5).",
  reconstruction: "How moments become ranges: estimator, neighbours, outliers, frames that stand still.",
  calibration: "Measures what is the camera's own, so that ranges are right: by a diffuser, or a wall at a known range.",
  simulation: "The scene before a simulated camera, which effects it calls for, and which it does not.",
  events: "All notices and faults of this page and the camera, with their times (log, messages).",
};
