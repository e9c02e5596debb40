import type { ComponentChildren, RefObject } from "preact";
import { useId, useRef } from "preact/hooks";

import "./PopoverButton.css";

interface PopoverButtonProps {
  /** What stands on the button. */
  readonly face: ComponentChildren;
  readonly label: string;
  readonly title: string;
  readonly kind: string;
  readonly role?: "dialog" | "menu";
  /** What is opened, for who opens it otherwise. */
  readonly popover?: RefObject<HTMLDivElement | null>;
  readonly onOpened?: () => void;
  readonly onButtonKey?: (event: KeyboardEvent) => void;
  readonly onKey?: (event: KeyboardEvent) => void;
  readonly children: ComponentChildren;
}

/** A button and what it opens over the page; Escape or a click elsewhere closes it. */
export function PopoverButton(props: PopoverButtonProps) {
  const { face, label, title, kind, role = "dialog", popover, onOpened, onButtonKey, onKey, children } = props;
  const id = useId();
  const button = useRef<HTMLButtonElement>(null);
  const own = useRef<HTMLDivElement>(null);
  return (
    <>
      <button
        ref={button}
        type="button"
        class={`${kind}-button`}
        aria-label={label}
        title={title}
        aria-haspopup={role}
        popovertarget={id}
        onKeyDown={onButtonKey}
      >
        {face}
      </button>
      {/* biome-ignore lint/a11y/useAriaPropsSupportedByRole: both roles have names */}
      <div
        ref={popover ?? own}
        id={id}
        class={`menu ${kind}`}
        role={role}
        aria-label={label}
        popover="auto"
        onKeyDown={onKey}
        onToggle={(event) => {
          if (event.newState !== "open" || button.current === null) return;
          placeBeside(event.currentTarget, button.current);
          onOpened?.();
        }}
      >
        {children}
      </div>
    </>
  );
}

/** Least distance between what opens and the edge of the window, in CSS px. */
const EDGE_PX = 8;
const GAP_PX = 4;

/** Puts an open popover below its button, or above where there is more room; within the window. */
function placeBeside(popover: HTMLElement, button: HTMLElement): void {
  const from = button.getBoundingClientRect();
  const { innerWidth, innerHeight } = window;
  const above = innerHeight - from.bottom < popover.scrollHeight && from.top > innerHeight - from.bottom;
  popover.style.maxHeight = `${(above ? from.top : innerHeight - from.bottom) - 2 * EDGE_PX}px`;
  popover.style.left = `${Math.max(EDGE_PX, Math.min(from.right, innerWidth - EDGE_PX) - popover.offsetWidth)}px`;
  popover.style.top = `${above ? Math.max(EDGE_PX, from.top - popover.offsetHeight - GAP_PX) : from.bottom + GAP_PX}px`;
}
