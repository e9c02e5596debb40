import { useRef } from "preact/hooks";

import { PopoverButton } from "./PopoverButton";
import "./ActionMenu.css";

export type Action = Readonly<{ text: string; run: () => void }>;

export type ActionGroup = Readonly<{ title: string; actions: readonly Action[] }>;

/**
 * Things to do, behind one small button: a menu after the WAI-ARIA pattern "menu button".
 *
 * Nothing runs before an entry is pressed: arrow keys only move between them.
 */
export function ActionMenu({ label, groups }: { label: string; groups: readonly ActionGroup[] }) {
  const menu = useRef<HTMLDivElement>(null);
  const filled = groups.filter(({ actions }) => actions.length > 0);
  const entries = (): HTMLElement[] => [...(menu.current?.querySelectorAll<HTMLElement>("[role=menuitem]") ?? [])];

  const onButtonKey = (event: KeyboardEvent): void => {
    if (event.key !== "ArrowDown" && event.key !== "ArrowUp") return;
    event.preventDefault();
    event.stopPropagation();
    menu.current?.showPopover();
    entries()
      .at(event.key === "ArrowUp" ? -1 : 0)
      ?.focus();
  };
  const onMenuKey = (event: KeyboardEvent): void => {
    event.stopPropagation(); // keys of the page would move the light
    if (event.key === "Tab") menu.current?.hidePopover();
    const all = entries();
    const texts = all.map((entry) => entry.textContent ?? "");
    const next = neighbour(texts, all.indexOf(document.activeElement as HTMLElement), event.key);
    if (next === null) return;
    event.preventDefault();
    all[next]?.focus();
  };
  return (
    <PopoverButton
      face="⋯"
      label={label}
      title={label}
      kind="actions"
      role="menu"
      popover={menu}
      onButtonKey={onButtonKey}
      onKey={onMenuKey}
      onOpened={() => {
        if (!menu.current?.contains(document.activeElement)) entries()[0]?.focus();
      }}
    >
      {filled.map(({ title, actions }) => (
        <div key={title} class="menu-group" role="group" aria-label={title}>
          <p class="menu-title small quiet" aria-hidden="true">
            {title}
          </p>
          {actions.map(({ text, run }) => (
            <button
              key={text}
              type="button"
              role="menuitem"
              tabIndex={-1}
              onClick={() => {
                menu.current?.hidePopover();
                run();
              }}
            >
              {text}
            </button>
          ))}
        </div>
      ))}
    </PopoverButton>
  );
}

/** Which entry a key leads to from entry `at`, of those with these `texts`; null for keys that lead nowhere. */
export function neighbour(texts: readonly string[], at: number, key: string): number | null {
  const count = texts.length;
  if (key === "ArrowDown") return (at + 1) % count;
  if (key === "ArrowUp") return (Math.max(0, at) - 1 + count) % count;
  if (key === "Home") return 0;
  if (key === "End") return count - 1;
  if (key.length !== 1 || key === " ") return null;
  // A letter leads to the next entry that begins with it.
  for (let step = 1; step <= count; step++) {
    const next = (at + step) % count;
    if (texts[next].toLowerCase().startsWith(key.toLowerCase())) return next;
  }
  return null;
}
