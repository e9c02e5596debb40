import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { LightOffButton } from "./LightOffButton";
import "./Dialog.css";

interface DialogProps {
  readonly open: boolean;
  readonly title: string;
  /** Called when the user leaves: by Escape, by a click beside it, or by what is inside. */
  readonly onClose: () => void;
  readonly children: ComponentChildren;
}

/** Something over the page that is to be answered or closed; the browser keeps the focus in it. */
export function Dialog({ open, title, onClose, children }: DialogProps) {
  const dialog = useRef<HTMLDialogElement>(null);
  /** The page closed it; the browser says so later, when it may be open again. */
  const closing = useRef(false);
  useEffect(() => {
    if (open && !dialog.current?.open) {
      dialog.current?.showModal();
    } else if (!open && dialog.current?.open) {
      closing.current = true;
      dialog.current.close();
    }
  }, [open]);
  return (
    <dialog
      ref={dialog}
      class="dialog"
      aria-label={title}
      onClose={() => {
        if (!closing.current) onClose();
        closing.current = false;
      }}
      onClick={(event) => {
        if (event.target === dialog.current) onClose(); // beside it
      }}
    >
      {open && (
        <>
          <div class="dialog-inside column">
            <h2>{title}</h2>
            {children}
          </div>
          <LightOffButton />
        </>
      )}
    </dialog>
  );
}

/** What is told to what stands in a dialog: how to close it. */
export type Done = Readonly<{ onDone: () => void }>;
