import { computed, effect, type Signal, signal } from "@preact/signals";
import { createContext } from "preact";
import { useContext } from "preact/hooks";

import type { AppliedDocument, CameraDocument } from "../stream/documents";
import { Accuracy } from "./accuracy";
import { Api, kindOf } from "./api";
import { Calibrations } from "./calibrations";
import { Caller } from "./caller";
import { Credentials } from "./credentials";
import { Details } from "./details";
import { Events } from "./events";
import { Frames } from "./frames";
import { LAYOUT, type Layout, OVERVIEW, SPACE, viewsOf } from "./layout";
import { Layouts } from "./layouts";
import { Lease } from "./lease";
import { TransientLook } from "./lightLook";
import { LightOff } from "./lightOff";
import { Looks } from "./looks";
import { MAP_PRODUCTS } from "./mapCatalogue";
import { Measures } from "./measures";
import { Noises } from "./noise";
import { type Pixel, pixelOf, pixelText } from "./pixel";
import { Player } from "./player";
import { RangeErrors } from "./rangeErrors";
import { Reconstruction } from "./reconstruction";
import { Recordings } from "./recordings";
import { Replay } from "./replay";
import { Sequencing } from "./sequencing";
import { aBoolean, browserShelf, oneOf, Settings, type Shelf } from "./settings";
import { Simulation } from "./simulation";
import { Status } from "./status";
import { Theme } from "./theme";
import { Trends } from "./trends";
import { VIEW_NAMES } from "./viewNames";
import { pixelsOf, type View, Viewport, WHOLE } from "./viewport";

/** All that the page knows. Views read and set it; what fills it is no concern of theirs. */
export class Store {
  readonly frames = new Frames();
  readonly status = new Status();
  readonly api: Api;
  /** Who this page is to the service. */
  readonly caller: Caller;
  /** Who controls the camera. */
  readonly lease: Lease;
  /** Switches the light off, whoever does. */
  readonly lightOff: LightOff;
  /** Why nothing can be changed from here; null where everything may. */
  readonly obstacle = computed(() => this.caller.obstacle.value ?? this.lease.obstacle.value);
  readonly recordings: Recordings;
  readonly reconstruction: Reconstruction;
  readonly calibrations: Calibrations;
  readonly simulation: Simulation;
  /** A recording in the place of the camera. */
  readonly replay: Replay;
  /** How far the range is off. */
  readonly rangeErrors: RangeErrors;
  /** How the flow of frames went. */
  readonly trends: Trends;
  /** What happened. */
  readonly events = new Events();
  readonly settings: Settings;
  /** The sequence in use, by the service; null until it is known. */
  readonly sequence = signal<AppliedDocument | null>(null);
  /** Changes it. */
  readonly sequencing: Sequencing;
  /** What accuracy costs in time. */
  readonly accuracy: Accuracy;
  /** What the camera is and can do; null until it is known. */
  readonly camera = signal<CameraDocument | null>(null);
  /** The page keeps the frame it shows although newer ones exist. */
  readonly held = signal(false);
  /** The pixel whose impulse response is shown. */
  readonly selected: Signal<Pixel | null>;
  /** Which part of the picture is shown. */
  readonly viewport: Viewport;
  /** That part in pixels: column and row of the first, width and height; null for the whole. */
  readonly sight = computed(() => sightOf(this.viewport.view.value, this.camera.value));
  /** Less is asked for where link or page are too slow for all. */
  readonly adapts: Signal<boolean>;
  /** Pixels that are kept, and a region. */
  readonly measures: Measures;
  /** The pixel under the pointer, in whichever view. */
  readonly pointed = signal<Pixel | null>(null);
  /** Time after which a flight repeats, by the frame on screen. */
  readonly period_s = computed(() => {
    const shown = this.frames.of("coefficients").value?.meta.base_frequency_hz;
    return 1 / (shown ?? this.sequence.value?.base_frequency_hz ?? 23e6);
  });
  readonly player = new Player(this.period_s);
  /** A calibration has the camera for itself, so that no frames come. */
  readonly calibrating = computed(
    () => this.status.cameraState.value === "calibrating" || this.calibrations.job.value?.state === "running",
  );
  /** How light in flight is shown. */
  readonly light: TransientLook;
  /** What only the service knows of the selected pixel. */
  readonly details: Details;
  readonly theme: Theme;
  /** How much pixels scatter from frame to frame. */
  readonly noises = new Noises(this.frames);
  /** How maps are shown. */
  readonly looks: Looks;
  /** The product that the map view shows. */
  readonly mapProduct: Signal<string>;
  /** The product that the second map shows beside it. */
  readonly secondMapProduct: Signal<string>;
  /** Whether the list of keys is open. */
  readonly help = signal(false);
  /** Whether it is asked who controls the camera. */
  readonly asksForControl = signal(false);
  /** Whether a token is asked for. */
  readonly asksForToken = signal(false);
  /** Where the views stand. */
  readonly layout: Signal<Layout>;
  /** Layouts under names, and the way back from changes of it. */
  readonly layouts: Layouts;
  /** Whether the list of all commands is open. */
  readonly palette = signal(false);
  /** Whether a name for the layout is asked for. */
  readonly asksForLayout = signal(false);
  /** The one view that is shown alone; null while all are. */
  readonly alone: Signal<string | null>;

  constructor({
    api = new Api(undefined, new Credentials(browserShelf("sessionStorage"))),
    shelf = browserShelf("localStorage"),
  }: { api?: Api; shelf?: Shelf | null } = {}) {
    this.api = api;
    const settings = new Settings(shelf);
    this.settings = settings;
    this.caller = new Caller(api);
    this.lease = new Lease(api);
    this.lightOff = new LightOff(api, (state) => this.status.cameraIs(state, Date.now() / 1000));
    this.recordings = new Recordings(api);
    this.reconstruction = new Reconstruction(api);
    this.calibrations = new Calibrations(api);
    this.simulation = new Simulation(api);
    this.sequencing = new Sequencing(api, this.events, this.sequence);
    this.accuracy = new Accuracy(api);
    this.replay = new Replay(api, this.frames, this.status);
    this.rangeErrors = new RangeErrors(this.frames, this.status, this.replay.active, this.held);
    this.trends = new Trends(this.status, this.rangeErrors);
    api.onRefusal = (problem) => {
      this.lease.refused(kindOf(problem));
      if (problem.status !== 401) return;
      this.api.credentials.refused.value = problem;
      this.caller.forget();
      this.asksForToken.value = true;
    };
    this.details = new Details(api);
    const aMap = oneOf(MAP_PRODUCTS.map(({ product }) => product));
    const secondMap = (map: string): string => (viewsOf(this.layout.value).includes("second-map") ? map : "");
    this.mapProduct = settings.of({ key: "map.product", link: "map", followed: true, initial: "range", ...aMap });
    this.secondMapProduct = settings.of({
      key: "second-map.product",
      link: "map2",
      followed: true,
      initial: "indirect",
      ...aMap,
      text: secondMap,
    });
    this.selected = settings.of<Pixel | null>({
      link: "pixel",
      followed: true,
      initial: null,
      text: (pixel) => (pixel === null ? "" : pixelText(pixel)),
      parse: pixelOf,
    });
    this.alone = settings.of<string | null>({ link: "view", followed: true, initial: null, ...oneOf<string>(VIEW_NAMES) });
    this.layout = settings.of(LAYOUT);
    effect(() => {
      const seesLight = this.frames.absent.value.coefficients === undefined;
      if (!seesLight && JSON.stringify(this.layout.peek()) === JSON.stringify(OVERVIEW)) this.layout.value = SPACE;
    });
    this.layouts = new Layouts(settings, this.layout);
    this.looks = new Looks(this.frames, settings);
    this.light = new TransientLook(this.frames.of("coefficients"), settings);
    this.measures = new Measures(settings);
    this.viewport = new Viewport(settings);
    this.adapts = settings.of({ key: "link.adapts", initial: true, ...aBoolean() });
    this.theme = new Theme(settings, systemScheme());
  }

  /** Shows all views of a layout. */
  showLayout(layout: Layout): void {
    this.layout.value = layout;
    this.alone.value = null;
  }
}

function sightOf(view: View, camera: CameraDocument | null): readonly number[] | null {
  const { width, height } = camera?.capabilities ?? {};
  return view === WHOLE || typeof width !== "number" || typeof height !== "number" ? null : pixelsOf(view, width, height);
}

/** Whether the system is dark, by the browser; null outside of one. */
function systemScheme(): MediaQueryList | null {
  return typeof matchMedia === "undefined" ? null : matchMedia("(prefers-color-scheme: dark)");
}

export const StoreContext = createContext<Store | null>(null);

export function useStore(): Store {
  const store = useContext(StoreContext);
  if (store === null) throw new Error("A view stands outside the store's context.");
  return store;
}
