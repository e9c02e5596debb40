/** What is looked at, as the part of the address behind #: it can be kept, sent and typed. */
import { effect } from "@preact/signals";

import { refusalIn } from "./api";
import type { LinkPart } from "./settings";
import type { Store } from "./store";

/** Holds what is shown, keeps its frame at the service and copies a link that opens that very frame. */
export async function share(target: Window, store: Store): Promise<void> {
  const frame = store.status.newest.peek()?.frame;
  if (store.replay.active.peek() || frame === undefined) return copyLink(target, store);
  [store.held.value, store.player.playing.value] = [true, false];
  await store.events.reported(async () => {
    const { id } = await store.recordings.start({ frame, name: `Shared frame ${frame}`, annotations: { ...store.measures.notes } });
    await copyLink(target, store, `recording=${id}&frame=1`);
  });
}

/** Puts the whole address of what is shown on the clipboard, and says so; shows it to be copied by hand where the browser refuses. */
export async function copyLink(target: Window, store: Store, kept = ""): Promise<void> {
  const hash = [...store.settings.hash(true).slice(1).split("&"), kept].filter(Boolean).join("&");
  const { href } = Object.assign(new URL(target.location.href), { hash });
  const what =
    kept === "" ? "this layout, pixel and time" : "this very frame to all who reach the service, and this layout, pixel and time";
  try {
    await target.navigator.clipboard.writeText(href);
    store.events.tell(`The link was copied: it shows ${what}, with pins, zoom and colours.`, "good");
  } catch {
    // Refused, or not over https.
    store.status.failed.value = `The link to what is shown: ${href}`;
  }
}

/** Pause before the address follows: browsers refuse pages that change it all the time. */
const PAUSE_MS = 400;

/** Goes where the address says, now and when it changes, and keeps it true. */
export function keepAddress(target: Window, store: Store): void {
  const { settings } = store;
  settings.add(timePart(store));
  settings.add(recordingPart(store));
  let known = target.location.hash;
  settings.follow(known);
  target.addEventListener("hashchange", () => {
    if (target.location.hash === known) return;
    known = target.location.hash;
    settings.follow(known);
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  effect(() => {
    const hash = settings.hash(false);
    clearTimeout(timer);
    // A time that waits for its period must not be forgotten meanwhile.
    if (store.sequence.value === null) return;
    timer = setTimeout(() => {
      // Another address was gone to, and its event is still to come: it must not be overwritten.
      if (hash === known || target.location.hash !== known) return;
      target.history.replaceState(target.history.state, "", hash);
      known = target.location.hash;
    }, PAUSE_MS);
  });
}

/** The time of flight at which the light is looked at; what plays has none. */
function timePart({ player, sequence, period_s }: Store): LinkPart {
  return {
    followed: true,
    write: () => {
      const time_s = player.playing.value ? 0 : player.time_s.value;
      return time_s === 0 ? "" : `time_ns=${Number((time_s * 1e9).toFixed(3))}`;
    },
    read: (said) => {
      const time_ns = said.get("time_ns");
      if (time_ns === null || !/^\d+(\.\d+)?$/.test(time_ns)) return;
      player.playing.value = false;
      // A time is a share of the period, which comes from the service.
      void until(() => {
        if (sequence.value === null) return undefined;
        player.seek((Number(time_ns) * 1e-9) / period_s.peek());
        return true;
      });
    },
  };
}

/** The recording that is shown, by its id, and which frame of it. */
function recordingPart(store: Store): LinkPart {
  const { replay } = store;
  return {
    followed: true,
    write: () => {
      const id = replay.recording.value?.id;
      if (id === undefined) return "";
      return replay.playing.value ? `recording=${id}` : `recording=${id}&frame=${replay.frame.value}`;
    },
    read: (said) => {
      const [id, frame] = [said.get("recording") ?? "", said.get("frame") ?? ""];
      if (/^[A-Za-z0-9][\w-]{0,199}$/.test(id)) void open(store, id, /^\d{1,12}$/.test(frame) ? Number(frame) : undefined);
      else replay.leave();
    },
  };
}

/** Shows a recording, or says why it cannot be shown. */
async function open(store: Store, recording: string, frame: number | undefined): Promise<void> {
  const { replay, status, api } = store;
  try {
    if (replay.recording.peek()?.id !== recording) await replay.open(recording, frame);
    else if (frame !== undefined) replay.seek(frame);
  } catch (error) {
    const { problem, message } = refusalIn(error);
    if (problem.status === 401) {
      const { token } = api.credentials;
      const before = token.peek();
      await until(() => (token.value === before ? undefined : (token.value ?? undefined)));
      await open(store, recording, frame);
      return;
    }
    status.failed.value = `The recording of this link cannot be shown: ${message}`;
  }
}

/** Waits until what is read from signals is there: resolves to the first answer that is not undefined. */
function until<T>(read: () => T | undefined): Promise<T> {
  return new Promise((resolve) => {
    const end = effect(() => {
      const found = read();
      if (found === undefined) return;
      resolve(found);
      queueMicrotask(() => end());
    });
  });
}
