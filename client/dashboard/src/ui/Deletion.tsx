import type { Signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { Button } from "./controls";

import { Dialog } from "./Dialog";
import { TaskLine } from "./Steer";
import { useTask } from "./useTask";

interface DeletionProps<T> {
  /** What is to be deleted; null while nothing is. */
  readonly doomed: Signal<T | null>;
  readonly kind: string;
  readonly remove: (doomed: T) => Promise<unknown>;
  /** What would be lost. */
  readonly children: (doomed: T) => ComponentChildren;
}

/** Asks before something is deleted: that cannot be undone. */
export function Deletion<T>({ doomed, kind, remove, children }: DeletionProps<T>) {
  const task = useTask();
  const { value } = doomed;
  const close = (): void => {
    task.dismiss();
    doomed.value = null;
  };
  const confirm = async (): Promise<void> => {
    if (value !== null && (await task.run("Delete…", () => remove(value)))) close();
  };
  return (
    <Dialog open={value !== null} title={`Delete this ${kind}?`} onClose={close}>
      <div class="control column">{value !== null && children(value)}</div>
      <TaskLine task={task} />
      <div class="row at-end">
        <Button onClick={close}>Keep</Button>
        <Button class="danger" task={task} onClick={() => void confirm()}>
          Delete
        </Button>
      </div>
    </Dialog>
  );
}
