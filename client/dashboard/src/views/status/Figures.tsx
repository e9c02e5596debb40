import { useComputed } from "@preact/signals";

import { CREDIBLE_LATENCY_S } from "../../store/status";
import { useStore } from "../../store/store";
import { engineering, fixed, grouped, NOTHING } from "../../ui/format";
import { PulseIcon } from "../../ui/icons";
import { PopoverButton } from "../../ui/PopoverButton";

/** All figures of the flow of frames, behind a button. */
export function Figures() {
  const { status } = useStore();
  const latency = useComputed(() => {
    const latency_s = status.latency_s.value;
    if (latency_s === null) return NOTHING;
    if (latency_s < -0.05 || latency_s > CREDIBLE_LATENCY_S) return "clocks differ";
    return fixed(1000 * Math.max(0, latency_s), 0, "ms");
  });
  return (
    <PopoverButton face={<PulseIcon />} label="All figures" title="All figures of the flow of frames" kind="figures">
      <dl class="flow">
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
        <Figure name="Lost images" field="lost" title="Images that did not arrive from the camera intact since this page connected">
          {useComputed(() => grouped(status.lostImages.value))}
        </Figure>
        <Figure name="Sensor" field="temperature" title="Temperature of the sensor">
          {useComputed(() => fixed(status.newest.value?.temperature_c, 1, "°C"))}
        </Figure>
        <Figure name="Frame" field="frame" title="Number of the frame on screen">
          {useComputed(() => (status.newest.value === null ? NOTHING : grouped(status.newest.value.frame)))}
        </Figure>
      </dl>
    </PopoverButton>
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
    <div class="figure" title={title}>
      <dt>{name}</dt>
      <dd data-field={field}>{children}</dd>
    </div>
  );
}
