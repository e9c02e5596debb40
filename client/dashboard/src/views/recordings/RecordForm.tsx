import { useSignal } from "@preact/signals";

import { PAST_S } from "../../store/recordings";
import { useStore } from "../../store/store";
import { Button, Form, NumberField, TextField } from "../../ui/controls";
import type { Task } from "../../ui/useTask";
import { limitsOf } from "./limits";
import "./RecordForm.css";

/** What to call a recording and when to end it; and a button that saves what just happened. */
export function RecordForm({ task }: { task: Task }) {
  const { recordings } = useStore();
  const name = useSignal("");
  const duration_s = useSignal("");
  const size_mb = useSignal("");
  const frames = useSignal("");
  const limits = limitsOf({ duration_s: duration_s.value, size_mb: size_mb.value, frames: frames.value });
  const called = name.value.trim() === "" ? {} : { name: name.value.trim() };
  const start = async (): Promise<void> => {
    if (limits === null) return;
    if (await task.run("Starting…", () => recordings.start({ ...called, ...limits }))) name.value = "";
  };
  const savePast = async (): Promise<void> => {
    const saved = await task.run(`Saving the last ${PAST_S} s…`, () => recordings.savePast(called));
    if (saved) name.value = "";
  };
  const busy = task.busy.value !== null;
  return (
    <Form class="record-form" onSubmit={() => void start()}>
      <TextField label="Name" class="field record-name" name="name" maxLength={200} placeholder="named after the time" text={name} />
      <fieldset class="record-limits">
        <legend class="unseen">Ends after</legend>
        <NumberField label="Duration" unit="s" name="duration_s" placeholder="none" text={duration_s} />
        <NumberField label="Size" unit="MB" name="size_mb" placeholder="none" text={size_mb} />
        <NumberField label="Frames" unit="" name="frames" placeholder="none" text={frames} />
      </fieldset>
      <div class="record-actions row">
        <Button
          type="submit"
          class="strong"
          disabled={busy || limits === null}
          title={limits === null ? "A limit must be a number above 0" : "Record every frame, raw"}
        >
          <i class="dot bad" aria-hidden="true" /> Record
        </Button>
        <Button disabled={busy} title="Keep what the service still holds of the time that has just passed" onClick={() => void savePast()}>
          Save the last {PAST_S} s
        </Button>
      </div>
    </Form>
  );
}
