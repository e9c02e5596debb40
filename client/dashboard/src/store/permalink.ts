/** What is looked at, as the part of the address behind #: it can be kept, sent and typed. */
import { effect } from "@preact/signals";

import { MAP_PRODUCTS } from "../views/map/catalogue";
import { VIEW_NAMES } from "../views/names";
import { RequestError } from "./api";
import type { Pixel } from "./pixel";
import type { Store } from "./store";

export interface Place {
  readonly map?: string;
  readonly pixel?: Pixel;
  readonly time_ns?: number;
  /** The view that is shown alone. */
  readonly view?: string;
  /** The recording that is shown, by its id, and which frame of it. */
  readonly recording?: string;
  readonly frame?: number;
}

/** What an address says; parts that make no sense are as if they were not there. */
export function placeOf(hash: string): Place {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  const map = said.get("map");
  const pixel = /^(\d{1,5}),(\d{1,5})$/.exec(said.get("pixel") ?? "");
  const time_ns = said.get("time_ns");
  const view = said.get("view");
  const recording = said.get("recording");
  const frame = said.get("frame");
  return {
    ...(MAP_PRODUCTS.some(({ product }) => product === map) ? { map: map as string } : {}),
    ...(pixel === null ? {} : { pixel: { x: Number(pixel[1]), y: Number(pixel[2]) } }),
    ...(time_ns !== null && /^\d+(\.\d+)?$/.test(time_ns) ? { time_ns: Number(time_ns) } : {}),
    ...((VIEW_NAMES as readonly (string | null)[]).includes(view) ? { view: view as string } : {}),
    ...(recording !== null && /^[A-Za-z0-9][\w-]{0,199}$/.test(recording) ? { recording } : {}),
    ...(recording !== null && frame !== null && /^\d{1,12}$/.test(frame) ? { frame: Number(frame) } : {}),
  };
}

/** The address of a place; "" for nothing in particular. */
export function hashOf({ map, pixel, time_ns, view, recording, frame }: Place): string {
  const parts = [
    map === undefined ? "" : `map=${map}`,
    pixel === undefined ? "" : `pixel=${pixel.x},${pixel.y}`,
    time_ns === undefined ? "" : `time_ns=${Number(time_ns.toFixed(3))}`,
    view === undefined ? "" : `view=${view}`,
    recording === undefined ? "" : `recording=${recording}`,
    recording === undefined || frame === undefined ? "" : `frame=${frame}`,
  ].filter((part) => part !== "");
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
    const pixel = store.selected.value;
    const playing = store.player.playing.value;
    const view = store.alone.value;
    const time_s = playing ? 0 : store.player.time_s.value;
    const recording = store.replay.recording.value?.id;
    const frame = store.replay.playing.value ? undefined : store.replay.frame.value;
    const hash = hashOf({
      map: store.mapProduct.value,
      ...(pixel === null ? {} : { pixel }),
      ...(time_s === 0 ? {} : { time_ns: time_s * 1e9 }),
      ...(view === null ? {} : { view }),
      ...(recording === undefined ? {} : { recording, ...(frame === undefined ? {} : { frame }) }),
    });
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

function go(store: Store, { map, pixel, time_ns, view, recording, frame }: Place): void {
  if (recording === undefined) store.replay.leave();
  else void open(store, recording, frame);
  if (map !== undefined) store.mapProduct.value = map;
  if (pixel !== undefined) store.selected.value = pixel;
  if (view !== undefined) store.alone.value = view;
  if (time_ns === undefined) return;
  store.player.playing.value = false;
  const end = effect(() => {
    // A time is a share of the period, which the service tells.
    if (store.sequence.value === null) return;
    store.player.seek((time_ns * 1e-9) / store.period_s.peek());
    queueMicrotask(() => {
      end();
    });
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

/** Waits until somebody shows a token, or another one. */
function tokenOf({ api: { credentials } }: Store): Promise<void> {
  const before = credentials.token.peek();
  return new Promise((resolve) => {
    const end = credentials.token.subscribe((token) => {
      if (token === before || token === null) return;
      queueMicrotask(() => {
        end();
      });
      resolve();
    });
  });
}
