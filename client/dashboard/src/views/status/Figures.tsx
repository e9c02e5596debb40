import { useComputed } from "@preact/signals";
import { deviation, engineering, fixed, grouped, NOTHING } from "../../scales/format";
import { CREDIBLE_LATENCY_S } from "../../store/status";
import { useStore } from "../../store/store";
import { KEPT_S, linesOf, type PlotPoint, type Trend } from "../../store/trends";
import { notJudgedWords } from "../../ui/flags";
import { PulseIcon } from "../../ui/icons";
import { PopoverButton } from "../../ui/PopoverButton";
import "./Figures.css";

/** All figures of the flow of frames, behind a button. */
export function Figures() {
  const { status, rangeErrors } = useStore();
  const latency = useComputed(() => {
    const latency_s = status.latency_s.value;
    if (latency_s === null) return NOTHING;
    if (latency_s < -0.05 || latency_s > CREDIBLE_LATENCY_S) return "clocks differ";
    return fixed(1000 * Math.max(0, latency_s), 0, "ms");
  });
  const unjudged = notJudgedWords(rangeErrors.now.value?.not_judged);
  return (
    <PopoverButton face={<PulseIcon />} label="All figures" title="All figures of the flow of frames" kind="figures">
      <dl class="flow flow-trends">
        <Figure name="Rate" field="flow-rate" title="Frames drawn a second" trend="rate_hz">
          {useComputed(() => fixed(status.rate_hz.value, 1, "Hz"))}
        </Figure>
        <Figure name="Error of the range" field="flow-error" title="In the median pixel" trend="error_m">
          {useComputed(() => deviation(rangeErrors.now.value?.error_m, "m"))}
        </Figure>
        <Figure name="Latency" field="latency" title="From the last image's arrival at the service to this screen" trend="latency_s">
          {latency}
        </Figure>
        <Figure name="Dropped" field="dropped" title="Frames left out for this page, which was slower than the camera" trend="dropped">
          {useComputed(() => grouped(status.dropped.value))}
        </Figure>
      </dl>
      {unjudged !== "" && <p class="small quiet flow-words" data-field="not-judged">{`Which ranges are trusted: ${unjudged}.`}</p>}
      <dl class="flow">
        <Figure name="Capture" field="capture" title="From the first exposure of a frame to the last">
          {useComputed(() => fixed(1000 * (status.newest.value?.capture_s ?? NaN), 1, "ms"))}
        </Figure>
        <Figure name="Reconstruct" field="reconstruct" title="Computing of a frame at the service">
          {useComputed(() => fixed(1000 * (status.newest.value?.reconstruct_s ?? NaN), 1, "ms"))}
        </Figure>
        <Figure name="Encode" field="encode" title="Bringing the products of a frame into the form they are sent in">
          {useComputed(() => engineering(status.encode_s.value, "s", 2))}
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
  /** What is drawn over the last minute beside it. */
  readonly trend?: Trend;
  readonly children: { readonly value: string };
}

function Figure({ name, field, title, trend, children }: FigureProps) {
  return (
    <div class="figure" title={title}>
      <dt class="small quiet">{name}</dt>
      <dd class={trend === undefined ? "" : "row apart"}>
        <span data-field={field}>{children}</span>
        {trend !== undefined && <Course name={name} trend={trend} />}
      </dd>
    </div>
  );
}

const [WIDTH, HEIGHT] = [88, 20];
/** Room for the width of the line. */
const EDGE = 1.5;

/** A figure over the last minute, from zero to its largest value, as a line in a text's height; a single sample is a dot. */
function Course({ name, trend }: { name: string; trend: Trend }) {
  const { samples } = useStore().trends;
  const { most, lines } = linesOf(samples.value, trend);
  const label = `${name} over the last ${KEPT_S} s, from 0 to ${MOST_WORDS[trend](most)}`;
  const place = ({ x, y }: PlotPoint): string =>
    `${(EDGE + x * (WIDTH - 2 * EDGE)).toFixed(1)} ${(HEIGHT - EDGE - y * (HEIGHT - 2 * EDGE)).toFixed(1)}`;
  // Of one point a line with round ends is a dot.
  const path = lines.map((line) => `M${line.map(place).join("L")}${line.length === 1 ? "h0" : ""}`).join("");
  return (
    <svg class="course" width={WIDTH} height={HEIGHT} role="img" aria-label={label}>
      <title>{label}</title>
      <path d={path} />
    </svg>
  );
}

const MOST_WORDS: Readonly<Record<Trend, (most: number) => string>> = {
  rate_hz: (most) => fixed(most, 1, "Hz"),
  error_m: (most) => engineering(most, "m", 2),
  latency_s: (most) => fixed(1000 * most, 0, "ms"),
  dropped: (most) => `${grouped(most)} in half a second`,
};
