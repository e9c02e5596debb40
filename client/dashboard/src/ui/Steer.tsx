import { useStore } from "../store/store";
import { Button, type ButtonProps } from "./controls";
import type { Task } from "./useTask";
import "./Steer.css";

/** A button that changes something of the camera: not to be pressed where that would be refused, and it says why. */
export function Steer({ title, disabled = false, ...button }: ButtonProps) {
  const obstacle = useStore().obstacle.value;
  return (
    <Button
      {...button}
      title={obstacle ?? title}
      disabled={disabled || obstacle !== null}
      data-obstacle={obstacle === null ? undefined : ""}
    />
  );
}

/** Why nothing can be changed here, beside controls that are disabled for it. */
export function Obstacle() {
  const { caller, obstacle, dialog } = useStore();
  if (obstacle.value === null) return null;
  const [way, asks] = caller.obstacle.value === null ? ["Take control…", "control" as const] : ["Token…", "token" as const];
  return (
    <p class="obstacle" role="status">
      {obstacle.value}: you can look, but not change this.{" "}
      <Button class="link" onClick={() => (dialog.value = asks)}>
        {way}
      </Button>
    </p>
  );
}

/** What a task is doing, or why it was refused. */
export function TaskLine({ task, field }: { task: Task; field?: string }) {
  const words = task.busy.value ?? task.refusal.value;
  return (
    <p class={task.refusal.value === null || task.busy.value !== null ? "task quiet" : "task refusal"} role="status" data-field={field}>
      {words ?? ""}
    </p>
  );
}
