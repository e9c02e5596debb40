import { useEffect } from "preact/hooks";
import { fixed, grouped } from "../../scales/format";
import { REPLAY_SPEEDS, type Replay, type Timeline } from "../../store/replay";
import { useStore } from "../../store/store";
import { Button, Choice } from "../../ui/controls";
import { PauseIcon, PlayIcon, StepIcon } from "../../ui/icons";
import { clock } from "./words";
import "./ReplayBar.css";

/** The timeline of the recording that the views show, and the way back to the camera. */
export function ReplayBar() {
  const { replay } = useStore();
  const recording = replay.recording.value;
  const timeline = replay.timeline.value;
  if (recording === null || timeline === null) return null;
  const playing = replay.playing.value;
  return (
    <section class="replay wrapped" aria-label="Replay" data-frame={replay.shown.value ?? undefined}>
      <div class="replay-name column">
        <strong class="clipped" title={recording.id}>
          {recording.name}
        </strong>
        <span class={`small clipped ${replay.trouble.value === null ? "quiet" : "refusal"}`} role="status" data-field="replay-status">
          {replay.trouble.value ?? <CapturedAt started_s={timeline.host_time_s ?? recording.started_s} replay={replay} />}
        </span>
      </div>
      <div class="replay-controls row">
        <Button class="play" aria-label="One frame back" title="One frame back ([)" onClick={() => replay.step(-1)}>
          <StepIcon back />
        </Button>
        <Button
          class="play"
          aria-label={playing ? "Pause the recording" : "Play the recording"}
          title="Play or pause the recording (P)"
          onClick={() => replay.toggle()}
        >
          {playing ? <PauseIcon /> : <PlayIcon />}
        </Button>
        <Button class="play" aria-label="One frame on" title="One frame on (])" onClick={() => replay.step(1)}>
          <StepIcon />
        </Button>
        <Choice bare label="Speed of the recording" chosen={replay.speed} of={REPLAY_SPEEDS} text={(speed) => `${speed} ×`} />
        <Choice
          bare
          label="Computed with"
          chosen={replay.settings}
          of={["recorded", "current"]}
          text={(settings) => (settings === "recorded" ? "recorded settings" : "present settings")}
        />
      </div>
      <Scrubber replay={replay} timeline={timeline} />
      <Button class="primary" onClick={() => replay.leave()}>
        Back to live
      </Button>
    </section>
  );
}

/** The recording from its first frame to its last; dragged, or moved by arrow keys. */
function Scrubber({ replay, timeline }: { replay: Replay; timeline: Timeline }) {
  const frame = replay.frame.value;
  const { first, last, count } = timeline;
  const time_s = replay.timeOf(frame);
  useEffect(() => {
    if (frame > last) replay.seek(last);
  }, [replay, frame, last]);
  return (
    <div class="scrubber grow">
      <input
        type="range"
        min={first}
        max={Math.max(last, first + 1)}
        step={1}
        value={frame}
        aria-label="Frame of the recording"
        aria-valuetext={`frame ${frame - first + 1} of ${count}, ${time_s.toFixed(2)} seconds`}
        onPointerDown={() => (replay.playing.value = false)}
        onKeyDown={(event) => {
          if (SLIDER_KEYS.includes(event.key)) event.stopPropagation(); // they would move the light
        }}
        onInput={(event) => {
          replay.playing.value = false;
          replay.seek(event.currentTarget.valueAsNumber);
        }}
      />
      <p class="scrubber-words small">
        <span data-field="replay-time">{fixed(time_s, 2, "s")}</span> <span class="quiet">of {fixed(replay.timeOf(last), 2, "s")}</span>
        <span class="scrubber-frame">
          <span class="quiet">frame</span> <span data-field="replay-frame">{grouped(frame - first + 1)}</span>{" "}
          <span class="quiet">of {grouped(count)}</span>
        </span>
      </p>
    </div>
  );
}

const SLIDER_KEYS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];

/** When the frame on screen was captured, by the clock on the wall. */
function CapturedAt({ started_s, replay }: { started_s: number | null; replay: Replay }) {
  if (started_s === null) return null;
  return <>captured {clock(started_s + replay.timeOf(replay.shown.value ?? replay.frame.value))}</>;
}
