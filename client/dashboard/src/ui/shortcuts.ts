import { LAYOUTS } from "../store/layout";
import { MAP_PRODUCTS } from "../store/mapCatalogue";
import { SPEEDS_NS } from "../store/player";
import type { Store } from "../store/store";

/** Flight passed by one press of an arrow key, in s. */
const STEP_S = 0.1e-9;
const LONG_STEP_S = 1e-9;

/** A key for the whole page. */
export interface Shortcut {
  /** As `KeyboardEvent.key` has it. */
  readonly keys: readonly string[];
  /** As it is written in the list of keys. */
  readonly shown: string;
  readonly words: string;
  /** It may be pressed together with Ctrl, as elsewhere. */
  readonly withControl?: boolean;
  readonly run: (store: Store, event: KeyboardEvent) => void;
}

function scrub({ player }: Store, flight_s: number): void {
  player.playing.value = false;
  player.step(flight_s);
}

function speedUp({ player }: Store, by: number): void {
  const at = SPEEDS_NS.indexOf(player.speed_ns.peek()) + by;
  player.speed_ns.value = SPEEDS_NS[Math.min(SPEEDS_NS.length - 1, Math.max(0, at))];
}

/** The panel that keys are meant for: the one with the focus, or under the pointer. */
function panelNow(): string | null {
  const panel = document.querySelector<HTMLElement>(".panel:focus-within") ?? document.querySelector<HTMLElement>(".panel:hover");
  return panel?.dataset.view ?? null;
}

/** All keys of the page, in the order they are listed. */
export const SHORTCUTS: readonly Shortcut[] = [
  { keys: [" "], shown: "Space", words: "play or pause the light", run: ({ player }) => player.toggle() },
  {
    keys: ["ArrowLeft"],
    shown: "←",
    words: "back by 0.1 ns, with Shift by 1 ns",
    run: (store, { shiftKey }) => scrub(store, shiftKey ? -LONG_STEP_S : -STEP_S),
  },
  {
    keys: ["ArrowRight"],
    shown: "→",
    words: "on by 0.1 ns, with Shift by 1 ns",
    run: (store, { shiftKey }) => scrub(store, shiftKey ? LONG_STEP_S : STEP_S),
  },
  { keys: ["Home"], shown: "Home", words: "to the start of the flight", run: ({ player }) => player.seek(0) },
  { keys: ["n"], shown: "N", words: "to the next arrival of light", run: ({ player }) => player.jump(true) },
  { keys: ["b"], shown: "B", words: "to the arrival before", run: ({ player }) => player.jump(false) },
  { keys: [","], shown: ",", words: "slower", run: (store) => speedUp(store, -1) },
  { keys: ["."], shown: ".", words: "faster", run: (store) => speedUp(store, 1) },
  { keys: ["h"], shown: "H", words: "hold the frame, or let it go", run: ({ held }) => (held.value = !held.peek()) },
  {
    keys: MAP_PRODUCTS.map((_, at) => String(at + 1)),
    shown: `1 to ${MAP_PRODUCTS.length}`,
    words: MAP_PRODUCTS.map(({ name }) => name.toLowerCase()).join(", "),
    run: ({ mapProduct }, { key }) => (mapProduct.value = MAP_PRODUCTS[Number(key) - 1].product),
  },
  { keys: ["p"], shown: "P", words: "play or pause the recording that is shown", run: ({ replay }) => replay.toggle() },
  { keys: ["["], shown: "[", words: "one frame back in the recording", run: ({ replay }) => replay.step(-1) },
  { keys: ["]"], shown: "]", words: "one frame on in the recording", run: ({ replay }) => replay.step(1) },
  { keys: ["x"], shown: "X", words: "switch the light off, whoever controls the camera", run: ({ lightOff }) => lightOff.press() },
  {
    keys: ["f"],
    shown: "F",
    words: "show the panel under the pointer alone, or all again",
    run: ({ alone }) => (alone.value = alone.peek() === null ? panelNow() : null),
  },
  { keys: ["v"], shown: "V", words: "blink: the other of the compared frames", run: ({ comparison }) => comparison.blink() },
  { keys: ["l"], shown: "L", words: "the next layout", run: (store) => nextLayout(store) },
  { keys: ["z"], shown: "Z", words: "undo the last change of the layout", withControl: true, run: ({ layouts }) => layouts.undo() },
  { keys: ["k"], shown: "K", words: "all commands, to be searched", withControl: true, run: ({ dialog }) => (dialog.value = "palette") },
  { keys: ["t"], shown: "T", words: "light, dark, or as the system", run: ({ theme }) => theme.next() },
  {
    keys: ["?"],
    shown: "?",
    words: "help: what is shown, and keys",
    run: ({ dialog }) => (dialog.value = dialog.peek() === "help" ? null : "help"),
  },
];

function nextLayout(store: Store): void {
  const all = Object.values({ ...LAYOUTS, ...store.layouts.named.peek() });
  const now = JSON.stringify(store.layout.peek());
  const at = all.findIndex((each) => JSON.stringify(each) === now);
  store.showLayout(all[(at + 1) % all.length]);
}

/** Keys for the whole page; the answer takes them away again. */
export function shortcuts(target: Window, store: Store): () => void {
  /** The button that was pressed by pointer and has the focus since; keys that come after are not meant for it. */
  let clicked: Element | null = null;
  const onClick = (event: MouseEvent): void => {
    clicked = event.detail > 0 && event.target instanceof Element ? event.target.closest("button") : null;
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.key === "Tab") clicked = null;
    if (event.altKey || typesText(event.target)) return;
    const control = event.ctrlKey || event.metaKey;
    const shortcut = SHORTCUTS.find(({ keys, withControl = false }) => keys.includes(event.key) && (withControl || !control));
    // A button that was reached by keys is pressed by the space bar already.
    if (shortcut === undefined || (event.key === " " && event.target instanceof HTMLButtonElement && event.target !== clicked)) return;
    event.preventDefault();
    shortcut.run(store, event);
  };
  target.addEventListener("click", onClick, true);
  target.addEventListener("keydown", onKeyDown);
  return () => {
    target.removeEventListener("click", onClick, true);
    target.removeEventListener("keydown", onKeyDown);
  };
}

/** Whether keys belong to what has the focus: text is typed there, or an option chosen. */
function typesText(target: EventTarget | null): boolean {
  if (target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) return true;
  return target instanceof HTMLInputElement && target.type !== "range";
}
