import { useEffect } from "preact/hooks";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import { TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { EXAMPLES, type Example } from "./examples";

/** Examples to choose from; on a simulated camera each can have its scene. */
export function Examples() {
  const store = useStore();
  const { simulation, camera, obstacle, settings } = store;
  const task = useTask();
  const simulated = camera.value?.simulated === true;
  useEffect(() => void (simulated && simulation.follow()), [simulation, simulated]);
  const show = async ({ scene, state }: Example): Promise<void> => {
    const moves = scene !== undefined && simulated && obstacle.value === null && simulation.world.value?.scene !== scene;
    if (moves && !(await task.run("Preparing the scene…", () => simulation.set({ scene })))) return;
    [store.alone.value, store.selected.value] = [null, null];
    settings.follow(state);
    store.dialog.value = null;
  };
  return (
    <div class="control column">
      {EXAMPLES.map((example) => (
        <div key={example.name} class="column">
          <Button task={task} onClick={() => void show(example)}>
            {example.name}
          </Button>
          <span class="small quiet">
            {example.words} {example.scene !== undefined && `Made for the simulated scene ${example.scene}.`}
          </span>
        </div>
      ))}
      <TaskLine task={task} />
    </div>
  );
}
