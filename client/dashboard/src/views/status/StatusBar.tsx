import { useComputed } from "@preact/signals";

import { useStore } from "../../store/store";
import { engineering, fixed, grouped, NOTHING } from "../../ui/format";
import { Steering } from "./Steering";

/** One line on how things stand: connection, camera, and the flow of frames. */
export function StatusBar() {
  return (
    <header class="bar">
      <h1 class="brand">
        <img src="/icon.svg" alt="" width="24" height="24" />
        transientcam
      </h1>
      <StateChip />
      <CameraName />
      <Flow />
      <Steering />
    </header>
  );
}

type Tone = "good" | "waiting" | "bad" | "still";

function StateChip() {
  const { status, held, replay, calibrating } = useStore();
  const state = useComputed((): { tone: Tone; word: string } => {
    if (status.connection.value.kind === "connecting") return { tone: "waiting", word: "Connecting" };
    if (status.connection.value.kind === "waiting") return { tone: "bad", word: "Reconnecting" };
    if (status.connection.value.kind === "refused") return { tone: "bad", word: "Not let in" };
    if (replay.active.value) return { tone: "still", word: "Replay" };
    if (status.cameraLoss.value !== null) return { tone: "bad", word: "Camera lost" };
    if (calibrating.value) return { tone: "waiting", word: "Calibrating" };
    if (held.value) return { tone: "still", word: "Held" };
    if (status.running.value === false) return { tone: "still", word: "Stopped" };
    if (status.newest.value === null) return { tone: "waiting", word: "Waiting" };
    return { tone: "good", word: "Live" };
  });
  const { tone, word } = state.value;
  return (
    <span class={`chip chip-${tone}`} role="status" data-field="state">
      <i aria-hidden="true" />
      {word}
    </span>
  );
}

function CameraName() {
  const { camera } = useStore();
  if (camera.value === null) return null;
  const { capabilities } = camera.value;
  return (
    <span class="camera-name" title={`Serial number ${String(capabilities["serial"])}`}>
      {String(capabilities["model"])}
    </span>
  );
}

/** A frame older than this, or from the future, tells of two clocks that differ and not of latency. */
const CREDIBLE_LATENCY_S = 30;

function Flow() {
  const { status } = useStore();
  const latency = useComputed(() => {
    const latency_s = status.latency_s.value;
    if (latency_s === null) return NOTHING;
    if (latency_s < -0.05 || latency_s > CREDIBLE_LATENCY_S) return "clocks differ";
    return fixed(1000 * Math.max(0, latency_s), 0, "ms");
  });
  return (
    <dl class="flow">
      <Figure name="Rate" field="rate" title="Frames drawn a second">
        {useComputed(() => fixed(status.rate_hz.value, 1, "Hz"))}
      </Figure>
      <Figure name="Latency" field="latency" title="From the last image's arrival at the service to this screen">
        {latency}
      </Figure>
      <Figure name="Capture" field="capture" title="From the first exposure of a frame to the last">
        {useComputed(() => fixed(1000 * (status.newest.value?.capture_s ?? NaN), 1, "ms"))}
      </Figure>
      <Figure name="Reconstruct" field="reconstruct" title="Computing of a frame at the service">
        {useComputed(() => fixed(1000 * (status.newest.value?.reconstruct_s ?? NaN), 1, "ms"))}
      </Figure>
      <Figure name="Encode" field="encode" title="Bringing the products of a frame into the form they are sent in">
        {useComputed(() => engineering(status.encode_s.value, "s", 2))}
      </Figure>
      <Figure name="Dropped" field="dropped" title="Frames left out for this page, which was slower than the camera">
        {useComputed(() => grouped(status.dropped.value))}
      </Figure>
      <Figure name="Lost images" field="lost" title="Images that did not arrive from the camera intact">
        {useComputed(() => grouped(status.lostImages.value))}
      </Figure>
      <Figure name="Sensor" field="temperature" title="Temperature of the sensor">
        {useComputed(() => fixed(status.newest.value?.temperature_c, 1, "°C"))}
      </Figure>
      <Figure name="Frame" field="frame" title="Number of the frame on screen">
        {useComputed(() => (status.newest.value === null ? NOTHING : grouped(status.newest.value.frame)))}
      </Figure>
    </dl>
  );
}

interface FigureProps {
  readonly name: string;
  readonly field: string;
  readonly title: string;
  readonly children: { readonly value: string };
}

function Figure({ name, field, title, children }: FigureProps) {
  return (
    <div class={`figure figure-${field}`} title={title}>
      <dt>{name}</dt>
      <dd data-field={field}>{children}</dd>
    </div>
  );
}
