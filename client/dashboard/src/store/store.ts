import { computed, effect, type Signal, signal } from "@preact/signals";
import { createContext } from "preact";
import { useContext } from "preact/hooks";

import type { AppliedDocument, CameraDocument } from "../stream/documents";
import { Accuracy } from "./accuracy";
import { Api, kindOf } from "./api";
import { Calibrations } from "./calibrations";
import { Caller } from "./caller";
import { Comparison } from "./comparison";
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
import { Measures } from "./measures";
import { Noises } from "./noise";
import { type Pixel, pixelOf, pixelText } from "./pixel";
import { Player } from "./player";
import { RangeErrors } from "./rangeErrors";
import { Reconstruction } from "./reconstruction";
import { Recordings } from "./recordings";
import { Replay } from "./replay";
import { Sequencing } from "./sequencing";
import { Series } from "./series";
import { aBoolean, browserShelf, type Kind, oneOf, Settings, type Shelf } from "./settings";
import { Simulation } from "./simulation";
import { Status } from "./status";
import { Theme } from "./theme";
import { Trends } from "./trends";
import { VIEW_NAMES } from "./viewNames";
import { pixelsOf, type View, Viewport, WHOLE } from "./viewport";

/** What the parts of the store are made with: a class of its own, as it has to be there before them. */
class Ground {
  constructor(
    readonly api: Api,
    readonly settings: Settings,
  ) {}
}

/** By its name: which ones other packages have is known later. */
const isMap = (value: unknown): value is string => typeof value === "string" && /^[a-z][\w-]{0,62}$/.test(value);
const A_MAP: Kind<string> = { accepts: isMap, text: String, parse: (text) => (isMap(text) ? text : undefined) };

/** What may be open over the page; one at a time. */
export type DialogName = "help" | "tour" | "examples" | "palette" | "layout" | "control" | "camera" | "token";

/** All that the page knows. Views read and set it; what fills it is no concern of theirs. */
export class Store extends Ground {
  readonly frames = new Frames();
  readonly status = new Status();
  readonly caller = new Caller(this.api);
  readonly lease = new Lease(this.api);
  readonly lightOff = new LightOff(this.api, (state) => this.status.cameraIs(state, Date.now() / 1000));
  /** Why nothing can be changed from here; null where everything may. */
  readonly obstacle = computed(() => this.caller.obstacle.value ?? this.lease.obstacle.value);
  readonly recordings = new Recordings(this.api);
  readonly reconstruction = new Reconstruction(this.api);
  readonly calibrations = new Calibrations(this.api);
  readonly simulation = new Simulation(this.api);
  readonly accuracy = new Accuracy(this.api);
  readonly series = new Series(this.api, this.settings);
  readonly details = new Details(this.api);
  readonly replay = new Replay(this.api, this.frames, this.status);
  /** The page keeps the frame it shows although newer ones exist. */
  readonly held = signal(false);
  /** How far the range is off. */
  readonly rangeErrors = new RangeErrors(this.frames, this.status, this.replay.active, this.held);
  readonly trends = new Trends(this.status, this.rangeErrors);
  readonly events = new Events();
  /** The sequence in use, by the service; null until it is known. */
  readonly sequence = signal<AppliedDocument | null>(null);
  /** Changes it. */
  readonly sequencing = new Sequencing(this.api, this.events, this.sequence);
  /** What the camera is and can do; null until it is known. */
  readonly camera = signal<CameraDocument | null>(null);
  /** The service has none, until one is chosen. */
  readonly cameraless = computed(() => this.camera.value?.capabilities.model === "none");
  /** A calibration has the camera for itself, so that no frames come. */
  readonly calibrating = computed(
    () => this.status.cameraState.value === "calibrating" || this.calibrations.job.value?.state === "running",
  );
  /** Time after which a flight repeats, by the frame on screen. */
  readonly period_s = computed(() => {
    const shown = this.frames.of("coefficients").value?.meta.base_frequency_hz;
    return 1 / (shown ?? this.sequence.value?.base_frequency_hz ?? 23e6);
  });
  readonly player = new Player(this.period_s);
  readonly noises = new Noises(this.frames);
  /** The pixel under the pointer, in whichever view. */
  readonly pointed = signal<Pixel | null>(null);
  /** What is open over the page, to be read or answered. */
  readonly dialog = signal<DialogName | null>(null);

  // Links say these in this order.

  /** The product that the map view shows. */
  readonly mapProduct = this.settings.of({ key: "map.product", link: "map", followed: true, initial: "range", ...A_MAP });
  /** The product that the second map shows beside it. */
  readonly secondMapProduct = this.settings.of({
    key: "second-map.product",
    link: "map2",
    followed: true,
    initial: "indirect",
    ...A_MAP,
    text: (map) => (viewsOf(this.layout.value).includes("second-map") ? map : ""),
  });
  /** The pixel whose impulse response is shown. */
  readonly selected = this.settings.of<Pixel | null>({
    link: "pixel",
    followed: true,
    initial: null,
    text: (pixel) => (pixel === null ? "" : pixelText(pixel)),
    parse: pixelOf,
  });
  /** The one view that is shown alone; null while all are. */
  readonly alone = this.settings.of<string | null>({ link: "view", followed: true, initial: null, ...oneOf<string>(VIEW_NAMES) });
  readonly layout: Signal<Layout> = this.settings.of(LAYOUT);
  /** A display on a wall: nothing but the pictures, how things stand, and the light's switch. */
  readonly kiosk = this.settings.of({ link: "kiosk", followed: true, initial: false, ...aBoolean("on", "") });
  readonly layouts = new Layouts(this.settings, this.layout);
  readonly comparison = new Comparison(this.frames, this.rangeErrors, this.settings);
  readonly looks = new Looks(this.frames, this.settings, this.comparison);
  readonly light = new TransientLook(this.frames.of("coefficients"), this.settings);
  readonly measures = new Measures(this.settings);
  readonly viewport = new Viewport(this.settings);
  /** That part in pixels: column and row of the first, width and height; null for the whole. */
  readonly sight = computed(() => sightOf(this.viewport.view.value, this.camera.value));
  /** Less is asked for where link or page are too slow for all. */
  readonly adapts = this.settings.of({ key: "link.adapts", initial: true, ...aBoolean() });
  readonly theme = new Theme(this.settings, systemScheme());

  constructor({
    api = new Api(undefined, new Credentials(browserShelf("sessionStorage"))),
    shelf = browserShelf("localStorage"),
  }: { api?: Api; shelf?: Shelf | null } = {}) {
    super(api, new Settings(shelf));
    api.onRefusal = (problem) => {
      this.lease.refused(kindOf(problem));
      if (problem.status !== 401) return;
      this.caller.forget();
      this.dialog.value = "token";
    };
    const absent = computed(() => this.camera.value?.capabilities.model === "none");
    effect(() => {
      if (absent.value) this.dialog.value = "camera";
      else if (this.dialog.peek() === "camera") this.dialog.value = null;
    });
    effect(() => {
      const seesLight = this.frames.absent.value.coefficients === undefined;
      if (!seesLight && JSON.stringify(this.layout.peek()) === JSON.stringify(OVERVIEW)) this.layout.value = SPACE;
    });
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
