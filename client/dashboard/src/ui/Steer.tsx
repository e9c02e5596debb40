import type { ComponentChildren } from "preact";

import { useStore } from "../store/store";
import type { Task } from "./useTask";
import "./Steer.css";

interface SteerProps {
  readonly onClick?: () => void;
  readonly title?: string;
  readonly primary?: boolean;
  readonly danger?: boolean;
  readonly disabled?: boolean;
  readonly submit?: boolean;
  /** What it waits for while that is busy. */
  readonly task?: Task;
  readonly children: ComponentChildren;
}

/** A button that changes something of the camera: not to be pressed where that would be refused, and it says why. */
export function Steer({ onClick, title, primary = false, danger = false, disabled = false, submit = false, task, children }: SteerProps) {
  const { obstacle } = useStore();
  return (
    <button
      type={submit ? "submit" : "button"}
      class={primary ? "primary" : danger ? "danger" : undefined}
      title={obstacle.value ?? title}
      disabled={disabled || obstacle.value !== null || (task !== undefined && task.busy.value !== null)}
      data-obstacle={obstacle.value === null ? undefined : ""}
      onClick={onClick}
    >
      {children}
    </button>
  );
}

/** Why nothing can be changed here, beside controls that are disabled for it. */
export function Obstacle() {
  const { caller, obstacle, asksForControl, asksForToken } = useStore();
  if (obstacle.value === null) return null;
  const [way, asks] = caller.obstacle.value === null ? ["Take control…", asksForControl] : ["Token…", asksForToken];
  return (
    <p class="obstacle" role="status">
      {obstacle.value}: you can look, but not change this.{" "}
      <button type="button" class="link" onClick={() => (asks.value = true)}>
        {way}
      </button>
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
