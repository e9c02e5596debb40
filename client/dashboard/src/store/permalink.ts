/** What is looked at, as the part of the address behind #: it can be kept, sent and typed. */
import { effect } from "@preact/signals";

import { refusalIn } from "./api";
import type { LinkPart } from "./settings";
import type { Store } from "./store";
import { until } from "./until";

/** Puts the whole address of what is shown on the clipboard, and says so; shows it to be copied by hand where the browser refuses. */
export async function copyLink(target: Window, store: Store): Promise<void> {
  const { href } = Object.assign(new URL(target.location.href), { hash: store.settings.hash(true) });
  try {
    await target.navigator.clipboard.writeText(href);
    store.events.tell("The link was copied: it shows this layout, pixel and time, with pins, zoom and colours.", "good");
  } catch {
    // Refused, or not over https.
    store.status.unreadable.value = `The link to what is shown: ${href}`;
  }
}

/** Pause before the address follows: browsers refuse pages that change it all the time. */
const PAUSE_MS = 400;

/** Goes where the address says, now and when it changes, and keeps it true. */
export function keepAddress(target: Window, store: Store): void {
  const { settings } = store;
  settings.add(timePart(store));
  settings.add(recordingPart(store));
  settings.add(scenePart(store));
  let written = target.location.hash;
  settings.follow(written);
  target.addEventListener("hashchange", () => {
    if (target.location.hash !== written) settings.follow(target.location.hash);
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  effect(() => {
    const hash = settings.hash(false);
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

/** The simulated scene that a link was made for: a page that is opened offers it and changes nothing by itself. */
function scenePart({ camera, simulation, events }: Store): LinkPart {
  const offer = async (scene: string): Promise<void> => {
    const { simulated } = await until(() => camera.value ?? undefined);
    if (simulated) await simulation.follow();
    if (simulation.world.peek()?.scene === scene) return;
    const show = { word: "Show it", run: () => void events.reported(() => simulation.set({ scene })) };
    events.tell(`This link is of the simulated scene ${scene}.`, "plain", simulated ? { remedy: show } : {});
  };
  return {
    write: () => "",
    read: (said) => {
      const scene = said.get("scene") ?? "";
      if (/^[\w-]{1,60}$/.test(scene)) void offer(scene);
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
    status.unreadable.value = `The recording of this link cannot be shown: ${message}`;
  }
}
