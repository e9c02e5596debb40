import { useEffect } from "preact/hooks";
import { engineering } from "../../scales/format";
import type { Fault } from "../../store/simulation";
import { useStore } from "../../store/store";
import type { EffectDocument } from "../../stream/documents";
import { Select } from "../../ui/controls";
import { Panel } from "../../ui/Panel";
import { Obstacle, Steer, TaskLine } from "../../ui/Steer";
import { type Task, useTask } from "../../ui/useTask";
import { OpenButton } from "../files/FileDrop";
import { effectWords, FAULTS, lacking, ordered, possible, sizeShare, sizeWords } from "./words";
import "./SimulationView.css";

/** The scene of a simulated camera, which effects it calls for, and what can be made to go wrong. */
export function SimulationView() {
  const { simulation, sequence } = useStore();
  const task = useTask();
  // what a scene calls for depends on the sequence
  useEffect(() => void simulation.refresh(), [simulation, sequence.value]);
  const world = simulation.world.value;
  const explanation = simulation.explanation.value;
  return (
    <Panel
      tools={
        world !== null && (
          <>
            <ScenePicker task={task} />
            <OpenButton kind=".toml" title="Put the camera before a scene of your own: a TOML file" />
          </>
        )
      }
    >
      <div class="panel-body column grow fades">
        {simulation.trouble.value !== null && <p class="quiet">{simulation.trouble.value}</p>}
        <Obstacle />
        {world !== null && (
          <p class="quiet scene-words">
            {world.scenes.find(({ name }) => name === world.scene)?.description ?? "A scene from a file"}. A scene of your own is opened
            here, or dropped on the page.
          </p>
        )}
        {world !== null && (
          <fieldset class="faults wrapped spaced">
            <legend class="small quiet">Let something go wrong</legend>
            {(world.faults as readonly Fault[]).map((fault) => {
              const { word, title } = FAULTS[fault];
              const cause = (): void => void task.run(`${title}…`, () => simulation.cause(fault));
              return (
                <Steer key={fault} title={title} task={task} disabled={!possible(fault, world.plugged)} onClick={cause}>
                  {word}
                </Steer>
              );
            })}
          </fieldset>
        )}
        <TaskLine task={task} field="simulation-status" />
        {/* last: it takes the service a while, and nothing may move when it comes */}
        {explanation !== null && <Effects task={task} />}
      </div>
    </Panel>
  );
}

function ScenePicker({ task }: { task: Task }) {
  const { simulation, obstacle } = useStore();
  const world = simulation.world.value;
  if (world === null) return null;
  const names = world.scenes.map(({ name }) => name);
  return (
    <label class="scene-picker inline-row">
      <span class="quiet roomy">Scene</span>
      <Select
        name="scene"
        aria-label="Scene"
        value={world.scene}
        of={names.includes(world.scene) ? names : [world.scene, ...names]}
        text={String}
        disabled={task.busy.value !== null || obstacle.value !== null}
        onChoose={(scene) => void task.run(`Preparing ${scene}…`, () => simulation.set({ scene }))}
      />
    </label>
  );
}

/** What each effect says of this scene and sequence; only what is called for is computed. */
function Effects({ task }: { task: Task }) {
  const { simulation } = useStore();
  const explanation = simulation.explanation.value;
  const chosen = Object.keys(simulation.world.value?.effects ?? {}).length > 0;
  if (explanation === null) return null;
  const built = explanation.effects.filter((effect) => effect.built).length;
  return (
    <div class="effects">
      <table class="effect-table">
        <caption class="quiet">
          <span data-field="effects-built">
            {built} of {explanation.effects.length}
          </span>{" "}
          effects are computed: those above {explanation.called_above} of the noise floor, which is{" "}
          {engineering(explanation.noise_floor_dn, "DN")}.{" "}
          {lacking(explanation.not_made).length > 0 && "Images lack light that the scene calls for and that cannot be made. "}
          {chosen && (
            <Steer task={task} onClick={() => void task.run("Leaving all effects to the scene…", () => simulation.set({ effects: {} }))}>
              Leave all to the scene
            </Steer>
          )}
        </caption>
        <thead class="small quiet">
          <tr>
            <th scope="col">Effect</th>
            <th scope="col">Size over noise</th>
            <th scope="col">Computed</th>
            <th scope="col">Why</th>
          </tr>
        </thead>
        <tbody>
          {ordered(explanation).map((effect) => (
            <EffectRow key={effect.effect} effect={effect} calledAbove={explanation.called_above} task={task} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function EffectRow({ effect, calledAbove, task }: { effect: EffectDocument; calledAbove: number; task: Task }) {
  const { simulation, obstacle } = useStore();
  const name = effectWords(effect.effect);
  const mine = simulation.world.value?.effects[effect.effect];
  return (
    <tr data-effect={effect.effect} data-built={effect.built}>
      <th scope="row">{name}</th>
      <td class="effect-size nowrap">
        <meter min={0} max={1} value={sizeShare(effect, calledAbove)} aria-label={`Size of ${name} over the noise floor`} />{" "}
        {sizeWords(effect)}
      </td>
      <td>
        {effect.choice === "always" || effect.choice === "never" ? (
          <span class="quiet">{effect.choice === "always" ? "always" : "cannot be made"}</span>
        ) : (
          <Select
            name={effect.effect}
            aria-label={`Whether ${name} is computed`}
            value={mine ?? ""}
            of={["", "auto", "on", "off"]}
            text={(choice) => ({ "": `${effect.built ? "yes" : "no"}, by the scene`, auto: "if called for", on: "on", off: "off" })[choice]}
            disabled={task.busy.value !== null || obstacle.value !== null}
            onChoose={(choice) =>
              void task.run(`Preparing ${name.toLowerCase()}…`, () => simulation.choose(effect.effect, choice === "" ? null : choice))
            }
          />
        )}
      </td>
      <td class="quiet effect-why">{effect.reason}</td>
    </tr>
  );
}
