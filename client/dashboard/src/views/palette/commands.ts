/** All that the page can do at once, to be searched by words. */
import { LAYOUTS } from "../../store/layout";
import { MAP_PRODUCTS } from "../../store/mapCatalogue";
import { copyLink } from "../../store/permalink";
import { PAST_S } from "../../store/recordings";
import type { Store } from "../../store/store";
import { THEMES } from "../../store/theme";
import { SHORTCUTS } from "../../ui/shortcuts";
import { chooseFile } from "../files/openFile";
import { VIEWS } from "../registry";
import { PRESETS } from "../sequence/presets";

export interface Command {
  /** Kind and name: "Map: Range". */
  readonly words: string;
  /** The key that does the same; "" for none. */
  readonly key: string;
  readonly run: () => void;
}

/** Everything that can be done now. What changes the camera is there only while it may be changed from here. */
export function commandsOf(store: Store): Command[] {
  const steering = store.obstacle.value === null;
  const scenes = steering ? (store.simulation.world.value?.scenes ?? []) : [];
  const applied = store.sequence.value;
  return [
    ...MAP_PRODUCTS.map(({ product, name }, at) => ({
      words: `Map: ${name}`,
      key: String(at + 1),
      run: () => void (store.mapProduct.value = product),
    })),
    ...VIEWS.map(({ name, title }) => ({ words: `Show alone: ${title}`, key: "", run: () => void (store.alone.value = name) })),
    ...Object.entries({ ...LAYOUTS, ...store.layouts.named.value }).map(([name, layout]) => ({
      words: `Layout: ${name}`,
      key: "",
      run: () => store.showLayout(layout),
    })),
    { words: "Layout: save or remove…", key: "", run: () => void (store.asksForLayout.value = true) },
    ...(steering && applied !== null
      ? PRESETS.map(({ name, sequence }) => ({
          words: `Sequence: ${name}`,
          key: "",
          run: () => void store.events.reported(() => store.sequencing.set({ ...applied, ...sequence })),
        }))
      : []),
    ...scenes.map(({ name }) => ({
      words: `Scene: ${name}`,
      key: "",
      run: () => void store.events.reported(() => store.simulation.set({ scene: name })),
    })),
    ...THEMES.map((theme) => ({
      words: `Colours: ${theme === "auto" ? "as the system" : theme}`,
      key: "",
      run: () => void (store.theme.choice.value = theme),
    })),
    ...recordingCommands(store),
    { words: "Open a file: scene, recording or calibration…", key: "", run: () => chooseFile(store) },
    { words: "Copy a link to what is shown", key: "", run: () => void copyLink(window, store) },
    ...SHORTCUTS.filter(({ shown }) => shown.length === 1 && shown !== "K").map(({ keys, shown, words, run }) => ({
      words: `Page: ${words}`,
      key: shown,
      run: () => run(store, new KeyboardEvent("keydown", { key: keys[0] })),
    })),
  ];
}

/** Recordings need no control of the camera. */
function recordingCommands(store: Store): Command[] {
  const { recordings } = store;
  const active = recordings.active.value;
  const does = (what: string, work: () => Promise<unknown>): Command => ({
    words: `Recording: ${what}`,
    key: "",
    run: () => void store.events.reported(work),
  });
  if (active !== null) return [does("stop", () => recordings.stop(active.id))];
  return [does("start", () => recordings.start({})), does(`save the last ${PAST_S} s`, () => recordings.savePast())];
}

/** Those that hold every word of a query, whatever its case and order; at whose beginning one stands come first. */
export function matching<T extends { readonly words: string }>(commands: readonly T[], query: string): T[] {
  const sought = query
    .toLowerCase()
    .split(/\s+/)
    .filter((word) => word !== "");
  const begun = ({ words }: T): number =>
    sought.filter((word) =>
      words
        .toLowerCase()
        .split(/[\s:]+/)
        .some((each) => each.startsWith(word)),
    ).length;
  return commands.filter(({ words }) => sought.every((word) => words.toLowerCase().includes(word))).sort((a, b) => begun(b) - begun(a));
}
