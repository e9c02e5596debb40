import { fixed } from "../../scales/format";
import { captureOne } from "../../store/capture";
import { share } from "../../store/permalink";
import { useStore } from "../../store/store";
import { ActionMenu } from "../../ui/ActionMenu";
import { Button, Toggle } from "../../ui/controls";
import { useNow } from "../../ui/hooks";
import { ControlIcon, HoldIcon, PauseIcon, PlayIcon, ShareIcon, SingleIcon } from "../../ui/icons";
import { Steer } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { pageActions } from "./pageActions";
import "./Steering.css";

/** What can be done to the camera and to the page from anywhere. */
export function Steering() {
  const store = useStore();
  return (
    <div class="steering row">
      <RecordingSign />
      <ControlButton />
      {!store.replay.active.value && (
        <Toggle on={store.held} title="Hold this frame while the camera goes on (H)">
          <HoldIcon /> <span class="wide">Hold</span>
        </Toggle>
      )}
      <Capture />
      <Button class="roomy" aria-label="Share" title="Copy a link that opens this very frame" onClick={() => void share(window, store)}>
        <ShareIcon />
      </Button>
      <ActionMenu label="Page: layout, colours, help" groups={pageActions(store)} />
    </div>
  );
}

/** Starts and stops the camera, or has it capture a single frame. */
function Capture() {
  const store = useStore();
  const task = useTask();
  const running = store.status.running.value;
  const run = async (words: string, work: () => Promise<unknown>): Promise<void> => {
    if (!(await task.run(words, work))) store.status.failed.value = task.refusal.peek();
  };
  const toggle = (): Promise<void> =>
    run("Switching", async () => {
      store.lightOff.withdraw();
      const { state } = await store.api.ask("PUT /acquisition", { body: { running: running !== true } });
      store.status.cameraIs(state, Date.now() / 1000);
    });
  const single = (): Promise<void> =>
    run("Capturing", async () => {
      store.lightOff.withdraw();
      store.held.value = false;
      store.replay.leave();
      await captureOne(store.api, store.sequence.peek()?.capture_s ?? 0);
      store.status.cameraIs("stopped", Date.now() / 1000);
    });
  if (running === null) return null;
  const occupied = store.calibrating.value ? "A calibration is being measured" : null;
  const busy = task.busy.value !== null || occupied !== null;
  return (
    <>
      <Steer title={occupied ?? "Stop the camera, capture one frame and look at it"} disabled={busy} onClick={() => void single()}>
        <SingleIcon /> <span class="wide">Single</span>
      </Steer>
      <Steer
        title={occupied ?? (running ? "Stop the camera; its light goes off" : "Start the camera")}
        disabled={busy}
        onClick={() => void toggle()}
      >
        {running ? <PauseIcon /> : <PlayIcon />} <span class="wide">{running ? "Stop" : "Start"}</span>
      </Steer>
    </>
  );
}

/** Who controls the camera; a click asks for control, or gives it back. */
function ControlButton() {
  const { lease, dialog, caller } = useStore();
  const control = lease.control.value;
  const barred = control.kind === "other" ? null : caller.obstacle.value;
  const words = barred !== null ? "View only" : control.kind === "us" ? "You have control" : "Take control";
  const tone = { unknown: "", free: "", us: "good", other: "waiting" }[control.kind];
  return (
    <Button
      class={`control-button ${barred === null ? tone : ""}`}
      title={barred === null ? "Who controls the camera" : `${barred}: it can look, but not take control`}
      data-field="control"
      data-obstacle={barred === null ? undefined : ""}
      onClick={() => (dialog.value = "control")}
    >
      <ControlIcon />
      {control.kind === "other" ? (
        <Other holder={control.holder} expires_s={control.expires_s} />
      ) : (
        <span class={barred !== null || control.kind === "free" ? "wide" : ""}>{words}</span>
      )}
    </Button>
  );
}

function Other({ holder, expires_s }: { holder: string; expires_s: number }) {
  const left_s = Math.max(0, Math.ceil(expires_s - useNow(1)));
  return (
    <>
      <span class="control-holder clipped">{holder}</span> <span class="quiet">{left_s} s</span>
    </>
  );
}

/** That a recording runs, and for how long. */
function RecordingSign() {
  const { recordings } = useStore();
  const active = recordings.active.value;
  if (active === null) return null;
  return (
    <span class="recording-sign inline-row nowrap bad strong" title={`${active.name} is being recorded`} data-field="recording-sign">
      <i class="dot" aria-hidden="true" /> {fixed(active.duration_s, 0, "s")}
    </span>
  );
}
