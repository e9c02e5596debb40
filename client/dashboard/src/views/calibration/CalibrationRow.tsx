import { useSignal } from "@preact/signals";
import { engineering, fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { CalibrationDocument, VerdictDocument } from "../../stream/documents";
import { ActionMenu } from "../../ui/ActionMenu";
import { Button } from "../../ui/controls";
import { download } from "../../ui/download";
import { Steer } from "../../ui/Steer";
import type { Task } from "../../ui/useTask";
import { clock } from "../replay/words";
import { ageOf, doubtOf, driftOf } from "./words";
import "../recordings/RecordingRow.css";

/** What is used where no calibration is. */
export function NominalRow({ active, task }: { active: boolean; task: Task }) {
  const { calibrations } = useStore();
  return (
    <li class={active ? "row recording recording-shown" : "row recording"} data-calibration="nominal">
      <div class="recording-words grow">
        <p class="recording-name strong">Nominal gains {active && <em class="tag small strong good">in use</em>}</p>
        <p class="small quiet line">those of an ideal modulation; nothing was measured</p>
      </div>
      {!active && (
        <Steer task={task} onClick={() => void task.run("Switching…", () => calibrations.activate("nominal"))}>
          Use
        </Steer>
      )}
    </li>
  );
}

/** One calibration of the list. */
export function CalibrationRow({ calibration, task, onDelete }: { calibration: CalibrationDocument; task: Task; onDelete: () => void }) {
  const { api, calibrations } = useStore();
  const { id, name, fits, reason, active, drift } = calibration;
  const called = name || id;
  const drifted = drift === null ? null : driftOf(drift);
  const doubt = doubtOf(calibration.verdict);
  const warned = useSignal(false);
  const forcing = doubt !== null && !calibration.forced;
  const use = (): void => {
    if (forcing && !warned.peek()) warned.value = true;
    else void task.run("Switching…", () => calibrations.activate(id, forcing));
  };
  return (
    <li class={active ? "row recording recording-shown" : "row recording"} data-calibration={id}>
      <div class="recording-words grow">
        <p class="recording-name strong" title={id}>
          {called} {active && fits && <em class="tag small strong good">in use</em>}{" "}
          {active && !fits && <em class="tag small strong waiting">waits for its sequence</em>}{" "}
          {doubt !== null && (
            <em class="tag small strong bad" data-field="verdict" title={calibration.verdict.reason ?? ""}>
              {doubt.tag}
            </em>
          )}
        </p>
        <p class="small quiet line">
          <span title={clock(calibration.created_at)}>{ageOf(calibration.age_s)}</span>
          <span>{fixed(calibration.temperature_c, 1, "°C")}</span>
          <span>{sequenceOf(calibration)}</span>
          <span>{engineering(calibration.bytes, "B")}</span>
        </p>
        {!fits && (
          <p class="refusal" data-field="misfit">
            Does not fit: {reason}
          </p>
        )}
        {doubt !== null && (warned.value || active) && (
          <div class="refusal row doubt" role="status" data-field="doubt">
            <Blocks verdict={calibration.verdict} />
            <p>
              {doubt.words} {calibration.verdict.reason} {!active && forcing && "Used anyway, ranges may be wrong everywhere."}
            </p>
          </div>
        )}
        {drifted !== null && (
          <p class={drifted.grown ? "refusal" : "small recording-notes"} data-field="drift">
            {drifted.words}
          </p>
        )}
      </div>
      {!active && (
        <Steer
          title={fits ? "Calibrate frames with it from the next one on" : (reason ?? "It does not fit")}
          disabled={!fits}
          task={task}
          onClick={use}
        >
          {forcing && warned.value ? "Use anyway" : "Use"}
        </Steer>
      )}
      <Button
        aria-label={`Export ${called}`}
        title="Its file, to be taken in elsewhere"
        task={task}
        onClick={() =>
          void task.run("Fetching the file…", () => download(api, `/calibrations/${encodeURIComponent(id)}/file`, `${id}.npz`))
        }
      >
        Export
      </Button>
      <ActionMenu
        label={`More of ${called}`}
        groups={[
          {
            title: called,
            actions: active
              ? [{ text: "Use the nominal gains", run: () => void task.run("Switching…", () => calibrations.activate("nominal")) }]
              : [{ text: "Delete…", run: onDelete }],
          },
        ]}
      />
    </li>
  );
}

function sequenceOf({ sequence, exposure_s }: CalibrationDocument): string {
  return `${engineering(Number(sequence.base_frequency_hz), "Hz")}, m = ${String(sequence.harmonics)}, ${engineering(exposure_s, "s")}`;
}

/** Which pixels speak against a diffuser, in blocks. */
function Blocks({ verdict: { blocks, block_px } }: { verdict: VerdictDocument }) {
  const [rows, columns] = [blocks.length, blocks[0]?.length ?? 0];
  if (!blocks.some((row) => row.includes("#") || row.includes("?"))) return null;
  return (
    <svg
      class="blocks"
      viewBox={`0 0 ${columns} ${rows}`}
      role="img"
      aria-label={`Blocks of ${block_px} pixels that are unlike a diffuser`}
    >
      {blocks.flatMap((row, y) =>
        [...row].map(
          (character, x) =>
            character !== "." && (
              <rect key={`${x}.${y}`} class={character === "#" ? "block-unlike" : "block-unknown"} x={x} y={y} width={1} height={1} />
            ),
        ),
      )}
    </svg>
  );
}
