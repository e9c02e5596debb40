import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { CalibrationDocument, JobDocument } from "../../stream/documents";
import { Button, Check, Form, NumberField, TextField } from "../../ui/controls";
import { Deletion } from "../../ui/Deletion";
import { Panel } from "../../ui/Panel";
import { Obstacle, Steer, TaskLine } from "../../ui/Steer";
import { type Task, useTask } from "../../ui/useTask";
import { chooseFile } from "../files/openFile";
import { CalibrationRow, NominalRow } from "./CalibrationRow";
import "../recordings/RecordForm.css";
import "./CalibrationView.css";

/** As the service has it where nothing is said. */
const DEFAULT_FRAMES = "40";

/** Calibrations: measure one, use it, see how it does, take it elsewhere. */
export function CalibrationView() {
  const { calibrations } = useStore();
  const task = useTask();
  const deleting = useSignal<CalibrationDocument | null>(null);
  useEffect(() => calibrations.follow(), [calibrations]);
  const known = calibrations.document.value;
  const job = calibrations.job.value;
  const outcome = calibrations.outcome.value;
  return (
    <Panel tools={<Import task={task} />}>
      <div class="panel-body column grow fades">
        {job === null ? <MeasureForm task={task} /> : <Measuring job={job} task={task} />}
        <Obstacle />
        <TaskLine task={task} field="calibration-status" />
        {outcome !== null && job === null && task.refusal.value === null && (
          <p class={outcome.good ? "quiet" : "refusal"} role="status" data-field="calibration-outcome">
            {outcome.words}
          </p>
        )}
        {known !== null && known.former !== null && job === null && (
          <Undo former={known.former} calibrations={known.calibrations} task={task} />
        )}
        {calibrations.trouble.value !== null && <p class="refusal">{calibrations.trouble.value}</p>}
        {known !== null && (
          <ul class="recording-list column" aria-label="Calibrations">
            <NominalRow active={known.active === "nominal"} task={task} />
            {known.calibrations.map((calibration) => (
              <CalibrationRow key={calibration.id} calibration={calibration} task={task} onDelete={() => (deleting.value = calibration)} />
            ))}
          </ul>
        )}
      </div>
      <Deletion doomed={deleting} kind="calibration" remove={({ id }) => calibrations.remove(id)}>
        {({ name, id }) => (
          <p>
            <strong>{name || id}</strong>: its images cannot be captured again as the camera was then.
          </p>
        )}
      </Deletion>
    </Panel>
  );
}

function MeasureForm({ task }: { task: Task }) {
  const { calibrations } = useStore();
  const name = useSignal("");
  const frames = useSignal(DEFAULT_FRAMES);
  const activate = useSignal(true);
  const count = Number(frames.value);
  const sensible = frames.value.trim() !== "" && Number.isInteger(count) && count >= 2;
  const measure = (): Promise<boolean> =>
    task.run("Starting…", () => calibrations.measure({ name: name.peek().trim(), frames: count, activate: activate.peek() }));
  return (
    <Form class="record-form measure-form" onSubmit={() => void measure()}>
      <TextField label="Name" class="field record-name" name="name" maxLength={200} placeholder="after warm-up" text={name} />
      <NumberField label="Frames, with and without light" unit="" name="frames" aria-invalid={!sensible} text={frames} />
      <div class="record-actions row">
        <Steer
          type="submit"
          class="primary"
          title="Measure with the present sequence; no frames come meanwhile"
          disabled={!sensible}
          task={task}
        >
          Measure
        </Steer>
      </div>
      <p class="quiet whole-row">
        Put filter and diffuser before the lens first, so that the light shines at the sensor. <Diffuser task={task} />{" "}
        <Check checked={activate.value} onChange={(checked) => (activate.value = checked)}>
          Use it at once
        </Check>
      </p>
    </Form>
  );
}

/** Puts the diffuser before the lens of a simulated camera, and takes it away; nothing for a real one. */
function Diffuser({ task }: { task: Task }) {
  const { simulation } = useStore();
  useEffect(() => void simulation.refresh(), [simulation]);
  const world = simulation.world.value;
  if (world === null) return null;
  const words = world.diffusor ? "Take the diffuser away" : "Put the diffuser before the lens";
  return (
    <Steer
      title={`${words} of the simulated camera`}
      task={task}
      onClick={() => void task.run(`${words}…`, () => simulation.set({ diffuser: !world.diffusor }))}
    >
      {words}
    </Steer>
  );
}

/** Returns to what was active before. */
function Undo({ former, calibrations: all, task }: { former: string; calibrations: readonly CalibrationDocument[]; task: Task }) {
  const { calibrations } = useStore();
  const called = former === "nominal" ? "the nominal gains" : all.find(({ id }) => id === former)?.name || former;
  return (
    <p class="calibration-undo">
      <Steer
        title="Calibrate frames by what was active before"
        task={task}
        onClick={() => void task.run("Switching…", () => calibrations.restore())}
      >
        Return to {called}
      </Steer>
    </p>
  );
}

/** The measurement that runs. */
function Measuring({ job, task }: { job: JobDocument; task: Task }) {
  const { calibrations } = useStore();
  return (
    <div class="measuring wrapped">
      <span>
        Measuring: <span data-field="job-step">{job.step}</span>
      </span>
      <span data-field="job-progress">{fixed(100 * job.progress, 0, "%")}</span>
      <span class="grow" />
      <Button task={task} onClick={() => void task.run("Cancelling…", () => calibrations.cancel())}>
        Cancel
      </Button>
      <progress max={1} value={job.progress} aria-label="Progress of the calibration" />
    </div>
  );
}

/** Takes in a file that was exported elsewhere. */
function Import({ task }: { task: Task }) {
  const store = useStore();
  const take = (file: File): void => void task.run(`Taking in ${file.name}…`, () => store.calibrations.take(file));
  return (
    <Button title="Take in a calibration that was exported elsewhere" task={task} onClick={() => chooseFile(store, ".npz", take)}>
      Import…
    </Button>
  );
}
