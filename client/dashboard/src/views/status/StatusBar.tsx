import { useComputed } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { engineering, fixed } from "../../scales/format";
import { flowTrouble } from "../../store/status";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import { useNow } from "../../ui/hooks";
import { LightOffButton } from "../../ui/LightOffButton";
import { Steer } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { shareWords } from "../sequence/words";
import { Figures } from "./Figures";
import { Steering } from "./Steering";
import { demandWords, exposureAdvice, lowerFrequency_hz } from "./words";
import "./StatusBar.css";
import type { Happening } from "../../store/events";

/** How things stand in three things: health, rate and deviation, and what one looks at; all else is behind a button. */
export function StatusBar() {
  const { kiosk } = useStore();
  if (kiosk.value) return <WallBar />;
  return (
    <header class="bar row">
      <h1 class="brand inline-row">
        <img src="icon.svg" alt="" width="24" height="24" />
        <span class="wide">transientcam</span>
      </h1>
      <StateChip />
      <NoWatchdog />
      <LessAsked />
      <Preparing />
      <Fault />
      <Performance />
      <Subject />
      <Figures />
      <Toasts />
      <Steering />
      <LightOffButton />
    </header>
  );
}

/** The same on a wall, which is kept from sleeping where the browser can do that. */
function WallBar() {
  useEffect(() => {
    if (window.top !== window) return; // it is for the page around this one to ask
    let lock: WakeLockSentinel | undefined;
    // Refused by power saving, say; the lock goes with the page's visibility.
    const wake = (): void =>
      void navigator.wakeLock?.request("screen").then(
        (held) => (lock = held),
        () => undefined,
      );
    wake();
    document.addEventListener("visibilitychange", wake);
    return () => {
      document.removeEventListener("visibilitychange", wake);
      void lock?.release();
    };
  }, []);
  return (
    <header class="bar row">
      <StateChip />
      <Subject />
      <LightOffButton />
    </header>
  );
}

/** A class of the style sheet. */
type Tone = "good" | "waiting" | "bad" | "quiet";

type State = Readonly<{ tone: Tone; word: string; why?: string }>;

function StateChip() {
  const { status, held, replay, calibrating, sequence, cameraless } = useStore();
  const now_s = useNow(1);
  const state = useComputed((): State => {
    if (status.connection.value.kind === "connecting") return { tone: "waiting", word: "Connecting" };
    if (status.connection.value.kind === "waiting") return { tone: "bad", word: "Reconnecting" };
    if (status.connection.value.kind === "refused") return { tone: "bad", word: "Not let in" };
    if (replay.active.value) return { tone: "quiet", word: "Replay" };
    if (cameraless.value) return { tone: "quiet", word: "No camera" };
    if (status.cameraLoss.value !== null) return { tone: "bad", word: "Camera lost" };
    if (calibrating.value) return { tone: "waiting", word: "Calibrating" };
    if (status.cameraState.value === "arming") return { tone: "waiting", word: "Light soon", why: "The camera's light is about to go on" };
    if (held.value) return { tone: "quiet", word: "Held" };
    if (status.running.value === false) return { tone: "quiet", word: "Stopped" };
    if (status.newest.value === null) return { tone: "waiting", word: "Waiting" };
    return { tone: "good", word: "Live" };
  });
  const { tone, word, why } = slowed(state.value, flowTrouble(status.flow.value, sequence.value?.frame_rate_hz ?? null, now_s));
  return <Sign field="state" short={word} long={why} tone={tone} />;
}

/** A live camera whose frames come too seldom or too late is not well. */
function slowed(state: State, trouble: string | null): State {
  return state.word === "Live" && trouble !== null ? { tone: "waiting", word: "Live, slow", why: trouble } : state;
}

/** That nothing in the camera switches its light off where the service fails. */
function NoWatchdog() {
  const warning = useStore().camera.value?.light_warning ?? null;
  return warning === null ? null : <Sign field="light-warning" short="No watchdog" long={warning} />;
}

/** That less is asked for than there is, and what. */
function LessAsked() {
  const { status, sight, replay } = useStore();
  const decision = status.demanded.value;
  if (decision === null || replay.active.value) return null;
  const { long, short } = demandWords(decision, sight.value !== null);
  return <Sign field="link" short={short} long={long} />;
}

/** That the service compiles what the frames are computed with. */
function Preparing() {
  const { caller, sequence } = useStore();
  const kernels = caller.kernels.value;
  if (kernels === null) return null;
  const m = sequence.value === null ? "" : `, m = ${sequence.value.harmonics}`;
  return (
    <Sign
      field="kernels"
      short={`Preparing kernels${m}, ${fixed(kernels.left_s, 0, "s")} left`}
      long={`Frames come more slowly until these are compiled: ${kernels.preparing.join(", ")}`}
    />
  );
}

/** Share of all pixels that are too far from their calibration from which on something is done about it. */
const DRIFTED = 0.1;

/** What spoils all ranges, the gravest alone, and a click that mends it. */
function Fault() {
  const { status, sequence, sequencing, camera, replay, rangeErrors, frames, alone } = useStore();
  const task = useTask();
  /** Of what an exposure was changed by a click, and to which: it is changed on until that is over, the other way round, or somebody sets another. */
  const settling = useRef<{ word: string; exposure_s: number } | null>(null);
  const [applied, shown] = [sequence.value, status.newest.value];
  const capabilities = camera.value?.capabilities ?? {};
  const advice = exposureAdvice(shown, capabilities, frames.of(frames.amplitude.value).value?.map?.high, settling.current !== null);
  // What was changed already shows with the frames to come.
  const changed = applied?.exposure_s !== shown?.exposure_s || applied?.base_frequency_hz !== shown?.base_frequency_hz;
  const expose = async (to: typeof advice): Promise<void> => {
    settling.current = null;
    if (applied === null || !to || to.exposure_s === null) return;
    await sequencing.set({ ...applied, exposure_s: to.exposure_s });
    settling.current = { word: to.word, exposure_s: Number(sequence.peek()?.exposure_s) };
  };
  useEffect(() => {
    if (settling.current === null || changed || !shown?.pixels || task.busy.value !== null) return;
    const { word, exposure_s } = settling.current;
    void task.run("Applying…", () => expose(advice?.word === word && applied?.exposure_s === exposure_s ? advice : null));
  }, [shown?.frame]);
  if (applied === null || shown === null || replay.active.value) return null;
  const mend = (field: string, word: string, remedy: string, long: string, work: () => Promise<unknown>) => (
    <span data-field={field}>
      <Steer title={task.refusal.value ?? long} task={task} onClick={() => void task.run("Applying…", work)}>
        <span>
          {word}
          <span class="wide">: {remedy}</span>
        </span>
      </Steer>
    </span>
  );
  if (advice !== null) {
    const { word, long, exposure_s } = advice;
    if (exposure_s === null || changed) return <Sign field="exposure" short={word} long={long} />;
    return mend("exposure", word, `exposure ${engineering(exposure_s, "s", 2)}`, long, () => expose(advice));
  }
  const trust = rangeErrors.of("range_error").value?.meta.accuracy?.trust;
  if (trust != null && trust.drift > DRIFTED * Object.values(trust).reduce((sum, count) => sum + count)) {
    const long = "The camera is much warmer or colder than at its calibration: shows how to calibrate it";
    return mend("drift", "Drifted", "calibrate", long, async () => void (alone.value = "calibration"));
  }
  const base_frequency_hz = changed ? null : lowerFrequency_hz(frames.of("range").value?.map ?? null, applied, capabilities);
  if (base_frequency_hz === null) return null;
  const [end, frequency] = [fixed(applied.unambiguous_range_m, 1, "m"), engineering(base_frequency_hz, "Hz", 3)];
  const long = `Ranges lie at the ends of the unambiguous ${end}: what is farther seems near. Sets the base frequency to ${frequency}`;
  return mend("ambiguous", "Out of range?", frequency, long, () => sequencing.set({ ...applied, base_frequency_hz }));
}

/** A sign in the header, and what it means. */
function Sign({ field, short, long, tone = "waiting sign" }: { field: string; short: string; long: string | undefined; tone?: string }) {
  return (
    <span class={`chip inline-row nowrap strong ${tone}`} role="status" data-field={field} title={long}>
      <i class={tone === "quiet" ? "dot square" : "dot"} aria-hidden="true" />
      {short}
    </span>
  );
}

/** Frames a second and how well they measure; leads to what accuracy costs. */
function Performance() {
  const { status, alone, accuracy, rangeErrors } = useStore();
  const rate = useComputed(() => fixed(status.rate_hz.value, 1, "Hz"));
  const { short, long } = shareWords(rangeErrors.now.value);
  const open = (): void => {
    alone.value = alone.peek() === "sequence" ? null : "sequence";
    if (alone.peek() !== null && accuracy.tradeoff.peek() === null && status.newest.peek() !== null) void accuracy.predict();
  };
  return (
    <Button class="performance nowrap strong" title={`Frames drawn a second; ${long}. Shows what accuracy costs`} onClick={open}>
      <span data-field="rate">{rate}</span>
      <span class="quiet roomy" data-field="deviation">
        {short}
      </span>
    </Button>
  );
}

/** What one looks at: the scene of a simulated camera, else the camera. */
function Subject() {
  const { camera, simulation, replay } = useStore();
  const recording = replay.active.value ? replay.recording.value : null;
  if (camera.value === null) return null;
  const { capabilities, simulated } = camera.value;
  const scene = simulation.world.value?.scene;
  const live = simulated && scene !== undefined ? `simulated ${scene}` : String(capabilities.model);
  const serial = String((recording?.camera ?? capabilities).serial);
  return (
    <span class="camera-name quiet clipped roomy" title={`Serial number ${serial}`} data-field="subject">
      {recording === null ? live : `recording ${recording.name}`}
    </span>
  );
}

/** How long a notice stays, one that something can be done about longer; and how many are seen together. */
const STAYS_S = 6;
const STAYS_TO_ACT_S = 20;
const MOST = 2;

/** What just happened, in the free part of the header: never over what can be pressed. It goes away by itself. */
function Toasts() {
  const { events } = useStore();
  const now_s = useNow(1);
  const fresh = events.all.value.filter((each) => now_s < endOf(each)).slice(-MOST);
  return (
    <div class="toasts column grow small" role="log" aria-label="What just happened">
      {fresh.map(({ number, words, tone, remedy }) => (
        <p key={number} class="toast row" title={words}>
          <i class={`dot ${tone}`} aria-hidden="true" />
          <span class="clipped">{words}</span>
          {remedy !== undefined && (
            <Button class="link" onClick={remedy.run}>
              {remedy.word}
            </Button>
          )}
        </p>
      ))}
    </div>
  );
}

/** When a notice goes away. */
function endOf({ at_s, remedy }: Happening): number {
  return at_s + (remedy === undefined ? STAYS_S : STAYS_TO_ACT_S);
}
