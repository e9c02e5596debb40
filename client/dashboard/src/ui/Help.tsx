import { Button } from "./controls";
import type { Done } from "./Dialog";
import { SHORTCUTS } from "./shortcuts";
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

/** The keys of the page, over the page. */
export function Help({ onDone }: Done) {
  const keys = [...SHORTCUTS.map(({ shown, words }) => [`\`${shown}\``, words] as const), ...TOGETHER];
  return (
    <>
      <dl class="keys">
        {keys.map(([pressed, words]) => (
          <div key={pressed}>
            <dt>{pressed.split("`").map((part, n) => (n % 2 === 1 ? <kbd key={n}>{part}</kbd> : part))}</dt>
            <dd>{words}</dd>
          </div>
        ))}
      </dl>
      <div class="row at-end">
        <Button onClick={onDone}>Close</Button>
      </div>
    </>
  );
}
