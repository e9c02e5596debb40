import { useSignal } from "@preact/signals";
import { useEffect, useId, useRef } from "preact/hooks";

import { useStore } from "../../store/store";
import type { Done } from "../../ui/Dialog";
import { commandsOf, matching } from "./commands";
import "./Palette.css";

/** All commands of the page, by the keyboard: type, choose by arrow keys, Enter. After the WAI-ARIA pattern "combobox" with a list. */
export function Palette({ onDone }: Done) {
  const store = useStore();
  const id = useId();
  const query = useSignal("");
  const chosen = useSignal(0);
  const list = useRef<HTMLUListElement>(null);
  const found = matching(commandsOf(store), query.value);
  const at = Math.min(chosen.value, found.length - 1);
  useEffect(() => list.current?.children[at]?.scrollIntoView({ block: "nearest" }), [at, query.value]);
  const run = (place: number): void => {
    const command = found[place];
    if (command === undefined) return;
    onDone();
    command.run();
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step !== undefined && found.length > 0) chosen.value = (at + step + found.length) % found.length;
    else if (event.key === "Enter") run(at);
    else return;
    event.preventDefault();
  };
  return (
    <div class="palette column spaced">
      <input
        type="text"
        role="combobox"
        aria-label="Search a command"
        aria-expanded="true"
        aria-controls={id}
        aria-autocomplete="list"
        aria-activedescendant={found.length > 0 ? `${id}-${at}` : undefined}
        autocomplete="off"
        spellcheck={false}
        autofocus
        placeholder="Map, layout, view, sequence, scene …"
        value={query.value}
        onInput={(event) => {
          query.value = event.currentTarget.value;
          chosen.value = 0;
        }}
        onKeyDown={onKeyDown}
      />
      <ul ref={list} id={id} role="listbox" aria-label="Commands" tabIndex={-1}>
        {found.map(({ words, key }, n) => (
          <li key={words} class="row apart" id={`${id}-${n}`} role="option" aria-selected={n === at} onClick={() => run(n)}>
            {words} {key !== undefined && <kbd>{key}</kbd>}
          </li>
        ))}
      </ul>
      {found.length === 0 && (
        <p class="quiet" role="status">
          Nothing is called that.
        </p>
      )}
    </div>
  );
}
