/** What is looked at, as the part of the address behind #: it can be kept, sent and typed. */
import { effect } from "@preact/signals";
import { RequestError } from "./api";
import { type Layout, viewsOf } from "./layout";
import type { LightChoice } from "./lightLook";
import { layoutOf, layoutText, lightOf, lightText, looksOf, lookText, partOf, partText, pinsOf, pinsText, pixelOf, pixelText, viewOf, viewText } from "./linkTexts";
import type { LookChoice } from "./looks";
import { MAP_PRODUCTS } from "./mapCatalogue";
import type { Pin, Region } from "./measures";
import type { Pixel } from "./pixel";
import { SIDES, type Side } from "./pixelSides";
import type { Store } from "./store";
import { VIEW_NAMES } from "./viewNames";
import type { View } from "./viewport";

export interface Place {
  readonly map?: string;
  /** The map beside it, of a layout that shows two. */
  readonly map2?: string;
  readonly pixel?: Pixel;
  readonly time_ns?: number;
  /** The view that is shown alone. */
  readonly view?: string;
  /** The recording that is shown, by its id, and which frame of it. */
  readonly recording?: string;
  readonly frame?: number;
  /** Where the views stand. */
  readonly layout?: Layout;
  /** Colours, scale and limits of maps, by their products; only of those that were chosen. */
  readonly looks?: Readonly<Record<string, LookChoice>>;
  /** What is shown of the pixel. */
  readonly side?: Side;
  /** How the light is shown. */
  readonly light?: LightChoice;
  readonly pins?: readonly Pin[];
  readonly region?: Region;
  /** The part of the picture in sight. */
  readonly sight?: View;
}

/** What an address says; parts that make no sense are as if they were not there. */
export function placeOf(hash: string): Place {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  const [map, map2] = [said.get("map"), said.get("map2")];
  const known = (name: string | null): name is string => MAP_PRODUCTS.some(({ product }) => product === name);
  const pixel = pixelOf(said.get("pixel") ?? "");
  const time_ns = said.get("time_ns");
  const view = said.get("view");
  const recording = said.get("recording");
  const frame = said.get("frame");
  const layout = layoutOf(said.get("layout") ?? "");
  const looks = looksOf(said.getAll("look"));
  const side = SIDES.find(({ value }) => value === said.get("side"))?.value;
  const light = lightOf(said.get("light") ?? "");
  const pins = pinsOf(said.get("pins") ?? "");
  const region = partOf(said.get("region") ?? "");
  const sight = viewOf(said.get("sight") ?? "");
  return {
    ...(known(map) ? { map } : {}),
    ...(known(map2) ? { map2 } : {}),
    ...(pixel === null ? {} : { pixel }),
    ...(time_ns !== null && /^\d+(\.\d+)?$/.test(time_ns) ? { time_ns: Number(time_ns) } : {}),
    ...((VIEW_NAMES as readonly (string | null)[]).includes(view) ? { view: view as string } : {}),
    ...(recording !== null && /^[A-Za-z0-9][\w-]{0,199}$/.test(recording) ? { recording } : {}),
    ...(recording !== null && frame !== null && /^\d{1,12}$/.test(frame) ? { frame: Number(frame) } : {}),
    ...(layout === null ? {} : { layout }),
    ...(Object.keys(looks).length === 0 ? {} : { looks }),
    ...(side === undefined ? {} : { side }),
    ...(light === null ? {} : { light }),
    ...(pins.length === 0 ? {} : { pins }),
    ...(region === null ? {} : { region }),
    ...(sight === null ? {} : { sight }),
  };
}

/** The whole address of what is shown, for another user: with layout, colours, scales, limits, pins, region and zoom. */
export function linkTo(target: Window, store: Store): string {
  const looks = Object.fromEntries([...store.looks.all].filter(([, look]) => look.chosen).map(([product, look]) => [product, look.choice]));
  const whole = new URL(target.location.href);
  const { pins, region } = store.measures;
  const part = region.peek();
  whole.hash = hashOf({
    ...placeNow(store),
    layout: store.layout.peek(),
    looks,
    side: store.side.peek(),
    light: store.light.choice,
    pins: pins.peek(),
    ...(part === null ? {} : { region: part }),
    sight: store.viewport.view.peek(),
  });
  return whole.href;
}

/** Puts that address on the clipboard, and says so; shows it to be copied by hand where the browser refuses. */
export async function copyLink(target: Window, store: Store): Promise<void> {
  const whole = linkTo(target, store);
  try {
    await target.navigator.clipboard.writeText(whole);
    store.events.tell("The link was copied: it shows this layout, pixel and time, with pins, zoom and colours.", "good");
  } catch {
    // Refused, or not over https.
    store.status.unreadable.value = `The link to what is shown: ${whole}`;
  }
}

/** The address of a place; "" for nothing in particular. */
export function hashOf({ map, map2, pixel, time_ns, view, recording, frame, layout, looks = {}, side, light, pins = [], region, sight }: Place): string {
  const part = (name: string, text: string | undefined): string => (text === undefined || text === "" ? "" : `${name}=${text}`);
  const parts = [
    part("map", map),
    part("map2", map2),
    part("pixel", pixel && pixelText(pixel)),
    part("time_ns", time_ns === undefined ? "" : String(Number(time_ns.toFixed(3)))),
    part("view", view),
    part("recording", recording),
    part("frame", recording && frame?.toString()),
    part("layout", layout && layoutText(layout)),
    ...Object.entries(looks).map(([product, look]) => part("look", lookText(product, look))),
    part("side", side),
    part("light", light && lightText(light)),
    part("pins", pinsText(pins)),
    part("region", region && partText(region)),
    part("sight", sight && viewText(sight)),
  ].filter((text) => text !== "");
  return parts.length === 0 ? "" : `#${parts.join("&")}`;
}

/** Pause before the address follows: browsers refuse pages that change it all the time. */
const PAUSE_MS = 400;

/** Goes where the address says, now and when it changes, and keeps it true. */
export function keepAddress(target: Window, store: Store): void {
  let written = target.location.hash;
  go(store, placeOf(written));
  target.addEventListener("hashchange", () => {
    if (target.location.hash !== written) go(store, placeOf(target.location.hash));
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  effect(() => {
    const hash = hashOf(placeNow(store));
    clearTimeout(timer);
    // A time that waits for its period must not be forgotten meanwhile.
    if (store.sequence.value === null) return;
    timer = setTimeout(() => {
      if (hash === written) return;
      written = hash;
      target.history.replaceState(target.history.state, "", hash);
    }, PAUSE_MS);
  });
}

/** What is looked at now, as far as the address follows it. */
function placeNow(store: Store): Place {
  const pixel = store.selected.value;
  const view = store.alone.value;
  const time_s = store.player.playing.value ? 0 : store.player.time_s.value;
  const recording = store.replay.recording.value?.id;
  const frame = store.replay.playing.value ? undefined : store.replay.frame.value;
  return {
    map: store.mapProduct.value,
    ...(viewsOf(store.layout.value).includes("second-map") ? { map2: store.secondMapProduct.value } : {}),
    ...(pixel === null ? {} : { pixel }),
    ...(time_s === 0 ? {} : { time_ns: time_s * 1e9 }),
    ...(view === null ? {} : { view }),
    ...(recording === undefined ? {} : { recording, ...(frame === undefined ? {} : { frame }) }),
  };
}

function go(store: Store, { map, map2, pixel, time_ns, view, recording, frame, layout, looks = {}, side, light, pins, region, sight }: Place): void {
  if (recording === undefined) store.replay.leave();
  else void open(store, recording, frame);
  if (layout !== undefined) store.layout.value = layout;
  for (const [product, choice] of Object.entries(looks)) store.looks.of(product).choice = choice;
  if (side !== undefined) store.side.value = side;
  if (light !== undefined) store.light.choice = light;
  if (pins !== undefined) store.measures.pins.value = pins;
  if (region !== undefined) store.measures.region.value = region;
  if (sight !== undefined) store.viewport.view.value = sight;
  if (map !== undefined) store.mapProduct.value = map;
  if (map2 !== undefined) store.secondMapProduct.value = map2;
  if (pixel !== undefined) store.selected.value = pixel;
  if (view !== undefined) store.alone.value = view;
  if (time_ns === undefined) return;
  store.player.playing.value = false;
  const end = effect(() => {
    // A time is a share of the period, which comes from the service.
    if (store.sequence.value === null) return;
    store.player.seek((time_ns * 1e-9) / store.period_s.peek());
    queueMicrotask(() => end());
  });
}

/** Shows a recording, or says why it cannot be shown. */
async function open(store: Store, recording: string, frame: number | undefined): Promise<void> {
  const { replay, status } = store;
  try {
    if (replay.recording.peek()?.id !== recording) await replay.open(recording, frame);
    else if (frame !== undefined) replay.seek(frame);
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    if (error.problem.status === 401) {
      await tokenOf(store);
      await open(store, recording, frame);
      return;
    }
    status.unreadable.value = `The recording of this link cannot be shown: ${error.message}`;
  }
}

/** Waits until the user enters a token, or another one. */
function tokenOf({ api: { credentials } }: Store): Promise<void> {
  const before = credentials.token.peek();
  return new Promise((resolve) => {
    const end = credentials.token.subscribe((token) => {
      if (token === before || token === null) return;
      queueMicrotask(() => end());
      resolve();
    });
  });
}
