import { useEffect } from "preact/hooks";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import { TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { EXAMPLES, type Example } from "./examples";

/** Examples to choose from; on a simulated camera each can have its scene. */
export function Examples({ onDone }: Done) {
  const store = useStore();
  const { simulation, camera, obstacle, settings } = store;
  const task = useTask();
  const simulated = camera.value?.simulated === true;
  useEffect(() => void (simulated && simulation.follow()), [simulation, simulated]);
  const show = async ({ scene, state }: Example, moves: boolean): Promise<void> => {
    if (scene !== undefined && moves && !(await task.run("Preparing the scene…", () => simulation.set({ scene })))) return;
    [store.alone.value, store.selected.value] = [null, null];
    settings.follow(state);
    onDone();
  };
  return (
    <div class="column spaced">
      {EXAMPLES.map((example) => {
        const { name, words, scene } = example;
        const elsewhere = scene !== undefined && simulated && simulation.world.value?.scene !== scene;
        const moves = elsewhere && obstacle.value === null;
        const needs =
          scene !== undefined && (moves ? `Puts the simulated camera before ${scene}` : `Made for the simulated scene ${scene}`);
        return (
          <div key={name} class="column">
            <Button task={task} onClick={() => void show(example, moves)}>
              {name}
            </Button>
            <span class="small quiet">
              {words} {(elsewhere || (scene !== undefined && !simulated)) && `${needs}.`}
            </span>
          </div>
        );
      })}
      <TaskLine task={task} />
    </div>
  );
}
