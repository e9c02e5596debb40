/** All that the page can do at once, to be searched by words. */
import { MAP_PRODUCTS } from "../../store/mapCatalogue";
import { PAST_S } from "../../store/recordings";
import type { Store } from "../../store/store";
import { SHORTCUTS } from "../../ui/shortcuts";
import { VIEWS, WORDS } from "../registry";
import { PRESETS } from "../sequence/presets";
import { pageActions } from "../status/pageActions";

export interface Command {
  /** Kind and name: "Map: Range". */
  readonly words: string;
  /** Other words that it is looked for by. */
  readonly also?: string;
  /** The key that does the same. */
  readonly key?: string;
  readonly run: () => void;
}

/** Everything that can be done now. What changes the camera is there only while it may be changed from here. */
export function commandsOf(store: Store): Command[] {
  const steering = store.obstacle.value === null;
  const scenes = steering ? (store.simulation.world.value?.scenes ?? []) : [];
  const applied = steering ? store.sequence.value : null;
  const { recordings, events } = store;
  const active = recordings.active.value;
  const does = (words: string, work: () => Promise<unknown>): Command => ({ words, run: () => void events.reported(work) });
  return [
    ...store.frames.maps.value.map(({ product, name }, at) => ({
      words: `Map: ${name}`,
      also: product === "range" ? "distance depth" : "",
      key: at < MAP_PRODUCTS.length ? String(at + 1) : undefined,
      run: () => void (store.mapProduct.value = product),
    })),
    ...VIEWS.map(({ name, title }) => ({
      words: `Show alone: ${title}`,
      also: WORDS[name],
      run: () => void (store.alone.value = name),
    })),
    ...pageActions(store).flatMap(({ title, actions }) =>
      actions.map(({ text, run }) => ({ words: `${title}: ${text}`, also: text === "Two maps" ? "compare" : "", run })),
    ),
    { words: "Page: full screen, or not", also: "fullscreen", run: toggleFullScreen },
    { words: "Page: display on a wall, or not", also: "kiosk", run: () => void (store.kiosk.value = !store.kiosk.peek()) },
    {
      words: "Panel: save its picture, figure or numbers…",
      also: "screenshot export download csv npy png svg",
      run: () => press(".actions-button"),
    },
    { words: "Panel: compare its map, or keep this frame…", also: "difference reference", run: () => press(".compare-button") },
    { words: "Panel: colours, limits and exposure of its picture…", also: "colormap look scale", run: () => press(".look-button") },
    ...(applied === null
      ? []
      : PRESETS.map(({ name, sequence }) => does(`Sequence: ${name}`, () => store.sequencing.set({ ...applied, ...sequence })))),
    ...scenes.map(({ name }) => does(`Scene: ${name}`, () => store.simulation.set({ scene: name }))),
    // Recordings need no control of the camera.
    ...(active === null
      ? [does("Recording: start", () => recordings.start({})), does(`Recording: save the last ${PAST_S} s`, () => recordings.savePast())]
      : [does("Recording: stop", () => recordings.stop(active.id))]),
    ...SHORTCUTS.filter(({ shown }) => shown.length === 1 && shown !== "K").map(({ keys, shown, words, run }) => ({
      words: `Page: ${words}`,
      key: shown,
      run: () => run(store, new KeyboardEvent("keydown", { key: keys[0] })),
    })),
  ];
}

/** Presses a button of the first panel that has one. */
function press(button: string): void {
  document.querySelector<HTMLElement>(`.panel ${button}`)?.click();
}

function toggleFullScreen(): void {
  void (document.fullscreenElement === null ? document.documentElement.requestFullscreen() : document.exitFullscreen());
}

/** Those that hold every word of a query, or are also called so, whatever its case and order; at whose beginning one stands come first. */
export function matching<T extends Pick<Command, "words" | "also">>(commands: readonly T[], query: string): T[] {
  const sought = query.toLowerCase().split(/\s+/).filter(Boolean);
  const begun = ({ words }: T): number => {
    const begins = words.toLowerCase().split(/[\s:]+/);
    return sought.filter((word) => begins.some((each) => each.startsWith(word))).length;
  };
  return commands
    .filter(({ words, also = "" }) => sought.every((word) => `${words} ${also}`.toLowerCase().includes(word)))
    .sort((a, b) => begun(b) - begun(a));
}
