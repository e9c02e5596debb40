import type { Setting } from "../../store/settings";
import { useStore } from "../../store/store";
import { Button, Form, TextField } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import { useNow } from "../../ui/hooks";
import { TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";

/** Longest name the service takes. */
const LONGEST_NAME = 80;

/** Who controls the camera, and the way to take control or give it back. */
export function ControlDialog({ onDone }: Done) {
  const store = useStore();
  const { lease } = store;
  const name = store.settings.of(HOLDER);
  const task = useTask();
  const now_s = useNow(1);
  const control = lease.control.value;
  const barred = store.caller.obstacle.value;
  const left = control.kind === "us" || control.kind === "other" ? `${Math.max(0, Math.ceil(control.expires_s - now_s))} s` : "";
  const act = async (words: string, work: () => Promise<void>): Promise<void> => {
    if (await task.run(words, work)) onDone();
  };
  const take = (takeover: boolean): Promise<void> => act("Taking control…", () => lease.take(name.peek().trim(), takeover));
  return (
    <Form
      class="control column"
      onSubmit={() => {
        if (control.kind !== "us") void take(control.kind === "other");
      }}
    >
      <p data-field="control-words">
        {control.kind === "unknown" && "Who controls the camera is not known yet."}
        {barred !== null && `${barred}: this page can look, but not take control. `}
        {control.kind === "free" &&
          barred === null &&
          "Control is free, so every client may change things. Take it, and only you may; others go on watching."}
        {control.kind === "us" && (
          <>
            You have control, as <strong>{control.holder}</strong>. This page renews it; if it stops doing so, the camera stops and its
            light goes off after {left}.
          </>
        )}
        {control.kind === "other" && (
          <>
            <strong>{control.holder}</strong> has control, for {left} unless it is renewed. You can watch, record, and switch the light off.
          </>
        )}
      </p>
      {control.kind !== "us" && (
        <TextField label="What others should call you" name="holder" autocomplete="nickname" maxLength={LONGEST_NAME} text={name} />
      )}
      <TaskLine task={task} field="control-status" />
      {control.kind === "other" && task.refusal.value !== null && (
        <p class="quiet">Control can be taken over from tokens of the same role or a lower one.</p>
      )}
      <div class="row at-end">
        <Button onClick={onDone}>Close</Button>
        {control.kind === "us" ? (
          <Button class="primary" task={task} onClick={() => void act("Giving control back…", () => lease.release())}>
            Give back
          </Button>
        ) : (
          <Button
            type="submit"
            class="primary"
            title={barred ?? undefined}
            disabled={barred !== null || task.busy.value !== null || control.kind === "unknown" || name.value.trim() === ""}
          >
            {control.kind === "other" ? "Take over" : "Take control"}
          </Button>
        )}
      </div>
    </Form>
  );
}

const HOLDER: Setting<string> = {
  key: "lease.holder",
  initial: "Dashboard",
  accepts: (value): value is string => typeof value === "string" && value.length <= LONGEST_NAME,
};
