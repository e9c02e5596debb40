import type { ComponentChildren } from "preact";

import { Dialog } from "./Dialog";
import { TaskLine } from "./Steer";
import { useTask } from "./useTask";

interface ConfirmProps {
  readonly open: boolean;
  readonly title: string;
  /** The word on the button that does it. */
  readonly word: string;
  readonly work: () => Promise<unknown>;
  readonly onClose: () => void;
  readonly children: ComponentChildren;
}

/** Asks before something is done that cannot be undone. */
export function Confirm({ open, title, word, work, onClose, children }: ConfirmProps) {
  const task = useTask();
  const confirm = async (): Promise<void> => {
    if (await task.run(`${word}…`, work)) onClose();
  };
  return (
    <Dialog
      open={open}
      title={title}
      onClose={() => {
        task.dismiss();
        onClose();
      }}
    >
      <div class="control column">{children}</div>
      <TaskLine task={task} />
      <div class="dialog-actions">
        <span class="spring" />
        <button type="button" onClick={onClose}>
          Keep
        </button>
        <button type="button" class="danger" disabled={task.busy.value !== null} onClick={() => void confirm()}>
          {word}
        </button>
      </div>
    </Dialog>
  );
}
