import { useSignal } from "@preact/signals";
import { useStore } from "../../store/store";
import type { RecordingDocument } from "../../stream/documents";
import { Button, Form, keptAs, Typed } from "../../ui/controls";
import { Dialog } from "../../ui/Dialog";
import { TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { annotationsOf, type Line, linesOf } from "./lines";
import "./Annotations.css";

/** What is written about a recording: names and what they say, one a line. */
export function Annotations({ recording, onClose }: { recording: RecordingDocument; onClose: () => void }) {
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
