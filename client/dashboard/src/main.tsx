import "./base.css";
import { effect } from "@preact/signals";
import { render } from "preact";

import { App } from "./App";
import { AnimationLoop } from "./store/animation";
import { StreamClient } from "./store/client";
import { keepAddress } from "./store/permalink";
import { Store, StoreContext } from "./store/store";
import "@fontsource-variable/inter/wght.css";

const loop = new AnimationLoop((callback) => requestAnimationFrame(callback));
const store = new Store();
const worker = new Worker(new URL("./stream/worker.ts", import.meta.url), { type: "module" });
const stream = new StreamClient(store, worker, loop);

// nothing plays before there is light; the frame that brings it wakes the loop
loop.add((elapsed_s) => store.frames.of("coefficients").peek() !== null && store.player.advance(elapsed_s));
loop.add((elapsed_s) => store.replay.advance(elapsed_s));
effect(() => {
  if (store.player.playing.value || store.player.scrubbed.value || store.replay.playing.value) loop.wake();
});
document.addEventListener("visibilitychange", () => stream.hid());
const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
store.player.playing.value = !still;
if (still) store.comparison.blink_hz.value = 0;

store.theme.show(document.documentElement);
keepAddress(window, store);
const root = document.getElementById("app");
if (root === null) throw new Error("The page has no place for the application.");
render(
  <StoreContext.Provider value={store}>
    <App onRetry={() => stream.retryNow()} />
  </StoreContext.Provider>,
  root,
);

const address = new URL("api/v1/stream", window.location.href);
address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
void stream.learnAbsent().then(() => stream.open(address.href));

window.addEventListener("pagehide", () => store.lease.abandon());

if (new URLSearchParams(window.location.search).has("debug")) {
  void import("./debug").then(({ expose }) => expose(store));
}
