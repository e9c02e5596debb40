import { useSignal } from "@preact/signals";
import { useStore } from "../../store/store";
import { Button, TextField } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import { SHORTCUTS } from "../../ui/shortcuts";
import { VIEWS, WORDS } from "../registry";
import { matching } from "./commands";
import "./Help.css";

/** What pointer and keys do together in pictures. Words between ` are keys. */
const TOGETHER: readonly (readonly [keys: string, words: string])[] = [
  ["`Shift` + arrows", "in a picture: move the selected pixel"],
  ["wheel, + −", "in a picture: zoom all pictures; a double click shows them whole"],
  ["`Shift` + click, `Enter`", "in a picture: pin a pixel as A, B or C"],
  ["`Shift` + drag, `R`", "in a picture: measure a rectangle; Escape removes it and the pins"],
  ["`Ctrl` + click, `C`", "in a picture: set or remove a corner of a polygon, and measure it"],
  ["two fingers, one that stays", "in a picture: zoom and move all pictures; pin the pixel"],
  ["arrows, + −", "in the points: turn, come nearer, go"],
];

/** What the views show, and the keys of the page, to be searched. */
export function Help({ onDone }: Done) {
  const { dialog } = useStore();
  const query = useSignal("");
  const views = VIEWS.map(({ name, title }) => ({ words: title, also: WORDS[name] }));
  const keys = [...SHORTCUTS.map(({ shown, words }) => [`\`${shown}\``, words] as const), ...TOGETHER];
  const found = matching([...views, ...keys.map(([words, also]) => ({ words, also }))], query.value);
  return (
    <>
      <div class="row wrapped spaced">
        <TextField label="Search" name="help" text={query} />
        <Button onClick={() => (dialog.value = "tour")}>A tour of one minute</Button>
        <Button onClick={() => (dialog.value = "examples")}>Examples</Button>
        <a href="docs">HTTP interface</a>
        <a href="problems">Problems explained</a>
        <a href="cameras">Other cameras</a>
      </div>
      <dl class="keys">
        {found.map(({ words, also }) => (
          <div key={words}>
            <dt>{words.split("`").map((part, n) => (n % 2 === 1 ? <kbd key={n}>{part}</kbd> : part))}</dt>
            <dd>{also}</dd>
          </div>
        ))}
      </dl>
      {found.length === 0 && (
        <p class="quiet" role="status">
          Nothing here has these words.
        </p>
      )}
      <div class="row at-end">
        <Button onClick={onDone}>Close</Button>
      </div>
    </>
  );
}
