import { engineering, grouped } from "../../scales/format";
import { recordingPath } from "../../store/api";
import { END_REASONS } from "../../store/events";
import { useStore } from "../../store/store";
import type { RecordingDocument } from "../../stream/documents";
import { ActionMenu } from "../../ui/ActionMenu";
import { Button } from "../../ui/controls";
import { download } from "../../ui/download";
import { PlayIcon } from "../../ui/icons";
import type { Task } from "../../ui/useTask";
import { clock, duration } from "../replay/words";
import "./RecordingRow.css";

const STATES: Readonly<Record<RecordingDocument["state"], string | null>> = {
  recording: "running",
  finishing: "finishing",
  complete: null,
  interrupted: "interrupted",
  recovering: "being recovered",
  damaged: "damaged",
};

type RowProps = Readonly<{ recording: RecordingDocument; task: Task; onAnnotate: () => void; onDelete: () => void }>;

/** One recording of the list. */
export function RecordingRow({ recording, task, onAnnotate, onDelete }: RowProps) {
  const { api, replay } = useStore();
  const { id, name, state, annotations, tags } = recording;
  const whole = state === "complete";
  const shown = replay.recording.value?.id === id;
  const notes = Object.entries({ ...annotations, ...(tags.length > 0 ? { tags: tags.join(", ") } : {}) }).map(
    ([key, value]) => `${key}: ${typeof value === "string" ? value : JSON.stringify(value)}`,
  );
  const why = recording.reason === null ? null : (END_REASONS[recording.reason] ?? recording.reason);
  return (
    <li class={shown ? "row recording recording-shown" : "row recording"} data-recording={id}>
      <Button
        class="play"
        aria-label={`Play ${name}`}
        title="Play it in all views"
        task={task}
        disabled={!whole}
        onClick={() =>
          void task.run("Opening…", async () => {
            await replay.open(id);
            replay.toggle();
          })
        }
      >
        <PlayIcon />
      </Button>
      <div class="recording-words grow">
        <p class="recording-name strong">
          {name} {STATES[state] !== null && <em class={`tag small strong ${state === "damaged" ? "bad" : "waiting"}`}>{STATES[state]}</em>}
        </p>
        <p class="small quiet line" title={why === null ? undefined : `It ${why}.`}>
          <span>{clock(recording.started_s)}</span>
          <span data-field="duration">{duration(recording.duration_s)}</span>
          <span data-field="frames">{grouped(recording.frames)} frames</span>
          <span data-field="size">{engineering(recording.size_bytes, "B")}</span>
          {recording.dropped_frames > 0 && <span class="refusal">{grouped(recording.dropped_frames)} left out</span>}
        </p>
        {notes.length > 0 && <p class="small recording-notes">{notes.join(" · ")}</p>}
        {recording.problem !== null && <p class="refusal">{recording.problem}</p>}
      </div>
      <Button
        task={task}
        disabled={!whole}
        title="The whole recording as HDF5"
        aria-label={`Download ${name}`}
        onClick={() => void task.run("Fetching the file…", () => download(api, `${recordingPath(id)}/file`, `${id}.h5`))}
      >
        Download
      </Button>
      <ActionMenu
        label={`More of ${name}`}
        groups={[
          {
            title: name,
            actions: [
              { text: "Notes…", run: onAnnotate },
              { text: "Delete…", run: onDelete },
            ],
          },
        ]}
      />
    </li>
  );
}
