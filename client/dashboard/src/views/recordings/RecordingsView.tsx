import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { engineering, grouped } from "../../scales/format";
import { ORDERS, PAGE, PAST_S } from "../../store/recordings";
import { useStore } from "../../store/store";
import type { RecordingDocument, RecordingsDocument } from "../../stream/documents";
import { Button, Choice, Form, keptAs, NumberField, TextField, Typed } from "../../ui/controls";
import { Deletion } from "../../ui/Deletion";
import { Panel } from "../../ui/Panel";
import { TaskLine } from "../../ui/Steer";
import { type Task, useTask } from "../../ui/useTask";
import { OpenButton } from "../files/FileDrop";
import { duration } from "../replay/words";
import { RecordingRow } from "./RecordingRow";
import "./RecordForm.css";
import "./RecordingsView.css";
import { Dialog } from "../../ui/Dialog";
import { annotationsOf, type Line, limitsOf, linesOf } from "./typed";

/** Recordings: start and stop one, look through them, play them, take them home. */
export function RecordingsView() {
  const store = useStore();
  const { recordings } = store;
  const task = useTask();
  const annotating = useSignal<RecordingDocument | null>(null);
  const deleting = useSignal<RecordingDocument | null>(null);
  useEffect(() => void recordings.refresh(), [recordings]);
  const known = recordings.document.value;
  const remove = (id: string): Promise<void> => {
    if (store.replay.recording.peek()?.id === id) store.replay.leave();
    return recordings.remove(id);
  };
  return (
    <Panel
      tools={
        <>
          {known?.free_bytes != null && (
            <span class="quiet" title={known.directory}>
              {engineering(known.free_bytes, "B")} free
            </span>
          )}
          <OpenButton kind=".h5" title="Show a recording by its file; the service takes one in that it does not have" />
        </>
      }
    >
      <div class="panel-body column grow fades">
        {recordings.active.value === null ? <RecordForm task={task} /> : <Running recording={recordings.active.value} task={task} />}
        <TaskLine task={task} field="recordings-status" />
        {recordings.trouble.value !== null && <p class="refusal">{recordings.trouble.value}</p>}
        {known !== null && <Looking known={known} />}
        <ul class="recording-list column">
          {known?.recordings
            .filter(({ id }) => id !== known.active)
            .map((recording) => (
              <RecordingRow
                key={recording.id}
                recording={recording}
                task={task}
                onAnnotate={() => (annotating.value = recording)}
                onDelete={() => (deleting.value = recording)}
              />
            ))}
        </ul>
        {known?.next_offset != null && recordings.limit.value < 1000 && (
          <Button onClick={() => (recordings.limit.value = recordings.limit.value + PAGE)}>Show more</Button>
        )}
      </div>
      {annotating.value !== null && <Annotations recording={annotating.value} onClose={() => (annotating.value = null)} />}
      <Deletion doomed={deleting} kind="recording" remove={({ id }) => remove(id)}>
        {({ name, frames, duration_s }) => (
          <p>
            <strong>{name}</strong>, {grouped(frames)} frames of {duration(duration_s)}. What it shows cannot be captured again.
          </p>
        )}
      </Deletion>
    </Panel>
  );
}

/** What is looked for, and what all that is found amounts to. */
function Looking({ known: { totals, tags } }: { known: RecordingsDocument }) {
  const { search, tag, order } = useStore().recordings;
  const all = search.value.trim() === "" && tag.value === "";
  if (all && totals.recordings === 0) return <p class="quiet recordings-none">Nothing was recorded yet.</p>;
  const known = new Set(["", tag.value, ...Object.keys(tags)]);
  return (
    <div class="wrapped">
      <TextField label="Search" class="field inline-row" name="search" maxLength={200} placeholder="name, camera or note" text={search} />
      {known.size > 1 && (
        <Choice label="Tag" chosen={tag} of={[...known]} text={(each) => (each === "" ? "any tag" : `${each} (${tags[each] ?? 0})`)} />
      )}
      <Choice label="Order" chosen={order} of={Object.keys(ORDERS) as (keyof typeof ORDERS)[]} text={(each) => ORDERS[each]} />
      <span class="quiet" data-field="recordings-found">
        {totals.recordings === 0
          ? "No recording has all of these words."
          : `${grouped(totals.recordings)} recordings, ${grouped(totals.frames)} frames, ${engineering(totals.size_bytes, "B")}, ${duration(totals.duration_s)}`}
      </span>
    </div>
  );
}

/** The recording that runs, and the way to end it. */
function Running({ recording, task }: { recording: RecordingDocument; task: Task }) {
  const { recordings, replay } = useStore();
  const limit_s = recording.limits?.duration_s ?? null;
  return (
    <div class="wrapped recording-now">
      <span class="recording-sign inline-row bad strong">
        <i class="dot" aria-hidden="true" /> {recording.name}
      </span>
      <span data-field="recording-duration">
        {duration(recording.duration_s)}
        {limit_s !== null && <span class="quiet"> of {duration(limit_s)}</span>}
      </span>
      <span data-field="recording-frames">
        {grouped(recording.frames)} <span class="quiet">frames</span>
      </span>
      <span data-field="recording-size">{engineering(recording.size_bytes, "B")}</span>
      {recording.dropped_frames > 0 && <span class="refusal">{grouped(recording.dropped_frames)} left out</span>}
      <span class="grow" />
      {replay.recording.value?.id !== recording.id && (
        <Button task={task} disabled={recording.frames === 0} onClick={() => void task.run("Opening…", () => replay.open(recording.id))}>
          Watch from its start
        </Button>
      )}
      <Button
        class="danger"
        task={task}
        onClick={() => void task.run("Writing the rest to the disk…", () => recordings.stop(recording.id))}
      >
        Stop recording
      </Button>
      {limit_s !== null && <progress max={limit_s} value={recording.duration_s} aria-label="Share of the recording that is done" />}
    </div>
  );
}

/** What to call a recording and when to end it; and a button that saves what just happened. */
function RecordForm({ task }: { task: Task }) {
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

/** What is written about a recording: names and what they say, one a line. */
function Annotations({ recording, onClose }: { recording: RecordingDocument; onClose: () => void }) {
  const { recordings } = useStore();
  const lines = useSignal<readonly Line[]>([...linesOf(recording.annotations), { name: "", text: "" }]);
  const task = useTask();
  const said = annotationsOf(lines.value);
  const set = (at: number, change: Partial<Line>): void => {
    lines.value = lines.peek().map((line, n) => (n === at ? { ...line, ...change } : line));
  };
  const write = async (): Promise<void> => {
    if (said !== null && (await task.run("Writing…", () => recordings.annotate(recording.id, said)))) onClose();
  };
  return (
    <Dialog open title={`Notes on ${recording.name}`} onClose={onClose}>
      <Form class="control column" onSubmit={() => void write()}>
        <div class="lines column spaced">
          {lines.value.map(({ name, text }, at) => (
            <div key={at} class="note">
              <Typed aria-label={`Name of line ${at + 1}`} placeholder="sample" text={keptAs(name, (typed) => set(at, { name: typed }))} />
              <Typed
                aria-label={`Text of line ${at + 1}`}
                placeholder="corner, white paint"
                text={keptAs(text, (typed) => set(at, { text: typed }))}
              />
              <Button aria-label={`Remove line ${at + 1}`} onClick={() => (lines.value = lines.peek().filter((_, n) => n !== at))}>
                ×
              </Button>
            </div>
          ))}
          <Button class="link" onClick={() => (lines.value = [...lines.peek(), { name: "", text: "" }])}>
            Add a line
          </Button>
        </div>
        {said === null && <p class="refusal">Each line needs a name of its own.</p>}
        <TaskLine task={task} />
        <div class="row at-end">
          <Button onClick={onClose}>Cancel</Button>
          <Button type="submit" class="primary" task={task} disabled={said === null}>
            Save
          </Button>
        </div>
      </Form>
    </Dialog>
  );
}
