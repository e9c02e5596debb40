import { useSignal } from "@preact/signals";

import { PAST_S } from "../../store/recordings";
import { useStore } from "../../store/store";
import { Form, NumberField, TextField } from "../../ui/controls";
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
  const number = (label: string, unit: string, text: typeof name, field: string) => (
    <NumberField label={label} unit={unit} name={field} placeholder="none" value={text.value} onType={(typed) => (text.value = typed)} />
  );
  const busy = task.busy.value !== null;
  return (
    <Form class="record-form" onSubmit={() => void start()}>
      <TextField label="Name" class="field record-name" name="name" maxLength={200} placeholder="named after the time" text={name} />
      <fieldset class="record-limits">
        <legend class="unseen">Ends after</legend>
        {number("Duration", "s", duration_s, "duration_s")}
        {number("Size", "MB", size_mb, "size_mb")}
        {number("Frames", "", frames, "frames")}
      </fieldset>
      <div class="record-actions row">
        <button
          type="submit"
          class="record"
          disabled={busy || limits === null}
          title={limits === null ? "A limit must be a number above 0" : "Record every frame, raw"}
        >
          <i aria-hidden="true" /> Record
        </button>
        <button
          type="button"
          disabled={busy}
          title="Keep what the service still holds of the time that has just passed"
          onClick={() => void savePast()}
        >
          Save the last {PAST_S} s
        </button>
      </div>
    </Form>
  );
}
