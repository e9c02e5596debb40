import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { refusalIn } from "../../store/api";
import { useStore } from "../../store/store";
import type { CameraChoicesDocument } from "../../stream/documents";
import { Form, TextField } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import { Obstacle, Steer, TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";

/** Which camera the service serves, what else it could, and what keeps it from finding more. */
export function CameraDialog({ onDone }: Done) {
  const { api } = useStore();
  const task = useTask();
  const found = useSignal<CameraChoicesDocument | null>(null);
  const name = useSignal("");
  useEffect(() => {
    api.ask("GET /camera/choices").then((choices) => (found.value = choices), refusalIn);
  }, [api, found]);
  const choose = async (camera: string): Promise<void> => {
    if (await task.run(`Opening ${camera}…`, () => api.ask("PUT /camera", { body: { camera } }))) onDone();
  };
  const { current = "", cameras = [], simulated = [], missing = [] } = found.value ?? {};
  const button = (camera: string) => (
    <Steer key={camera} task={task} disabled={camera === current} onClick={() => void choose(camera)}>
      {camera}
    </Steer>
  );
  return (
    <div class="column spaced">
      <Obstacle />
      <h3>Cameras</h3>
      {found.value === null && <p class="quiet">Looking for cameras…</p>}
      {found.value !== null && cameras.length === 0 && <p class="quiet">None was found on USB or on the network.</p>}
      {cameras.map(({ spec, product, problem }) => (
        <p key={spec} class="row spaced">
          {button(String(spec))} {String(problem ?? product ?? "")}
        </p>
      ))}
      {missing.map(({ check, message, remedy }) => (
        <p key={message} class="small quiet">
          {String(check)}: {String(message)}. {String(remedy ?? "")}
        </p>
      ))}
      <h3>Simulations</h3>
      <div class="wrapped spaced">{simulated.filter((each) => each !== "sim:measured").map(button)}</div>
      <Form class="row spaced" onSubmit={() => void choose(name.value.trim())}>
        <TextField label="Another one, as transientcam devices names it" name="camera" text={name} />
        <Steer type="submit" task={task} disabled={name.value.trim() === ""}>
          Open
        </Steer>
      </Form>
      <TaskLine task={task} field="camera-status" />
    </div>
  );
}
