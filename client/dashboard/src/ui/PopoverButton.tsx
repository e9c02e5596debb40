import type { ComponentChildren } from "preact";
import { useId, useRef } from "preact/hooks";

import { placeBeside } from "./popover";
import "./ActionMenu.css";
import "./PopoverButton.css";

interface PopoverButtonProps {
  /** What stands on the button. */
  readonly face: ComponentChildren;
  readonly label: string;
  readonly title: string;
  readonly kind: string;
  readonly children: ComponentChildren;
}

/** A button and what it opens over the page; Escape or a click elsewhere closes it. */
export function PopoverButton({ face, label, title, kind, children }: PopoverButtonProps) {
  const id = useId();
  const button = useRef<HTMLButtonElement>(null);
  return (
    <>
      <button
        ref={button}
        type="button"
        class={`${kind}-button`}
        aria-label={label}
        title={title}
        aria-haspopup="dialog"
        popovertarget={id}
      >
        {face}
      </button>
      <div
        id={id}
        class={`menu ${kind}`}
        role="dialog"
        aria-label={label}
        popover="auto"
        onToggle={(event) => {
          if (event.newState === "open" && button.current !== null) placeBeside(event.currentTarget, button.current);
        }}
      >
        {children}
      </div>
    </>
  );
}
