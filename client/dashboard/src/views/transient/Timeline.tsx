import { useEffect, useRef } from "preact/hooks";
import { rangeOfTime_m } from "../../physics/constants";
import { fixed } from "../../scales/format";
import { ticks } from "../../scales/scale";
import { useStore } from "../../store/store";
import { useDrawing } from "../../ui/hooks";
import "../map/Readout.css";
import "./Timeline.css";

/** Finest step of the slider, in shares of the period. */
const STEP = 1 / 2048;
const CURVE_HEIGHT = 64;
const CURVE_WIDTH = 512;

/** The time of flight as a slider over a curve of when light arrives in the whole picture. */
export function Timeline() {
  const { player, frames, period_s } = useStore();
  const canvas = useRef<HTMLCanvasElement>(null);
  const slider = useRef<HTMLInputElement>(null);
  const head = useRef<HTMLElement>(null);

  useDrawing(() => {
    const arrivals = frames.of("coefficients").value?.light?.arrivals;
    const context = canvas.current?.getContext("2d");
    if (arrivals === undefined || !context) return;
    drawCurve(context, arrivals);
  }, [frames]);

  useDrawing(() => {
    const turn = player.turn.value;
    const time_ns = player.time_s.value * 1e9;
    if (slider.current === null || head.current === null) return;
    slider.current.value = String(turn);
    slider.current.setAttribute("aria-valuetext", `${time_ns.toFixed(2)} nanoseconds`);
    head.current.style.left = `${100 * turn}%`;
  }, [player]);

  // The pointer may be let go anywhere.
  useEffect(() => {
    const release = (): void => {
      player.scrubbed.value = false;
    };
    for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, release);
    return () => {
      for (const end of ["pointerup", "pointercancel"]) window.removeEventListener(end, release);
      release();
    };
  }, [player]);

  const period_ns = period_s.value * 1e9;
  const period_m = rangeOfTime_m(period_s.value);
  const marks = ticks({ low: 0, high: period_ns, kind: "linear" }, 6);
  return (
    <div class="timeline">
      <canvas ref={canvas} width={CURVE_WIDTH} height={CURVE_HEIGHT} aria-hidden="true" />
      {player.arrivals.value.map((turn) => (
        <i key={turn} class="timeline-arrival" style={{ left: `${100 * turn}%` }} />
      ))}
      <i ref={head} class="timeline-head" />
      <input
        ref={slider}
        type="range"
        min={0}
        max={1}
        step={STEP}
        aria-label="Time of flight"
        onPointerDown={() => ([player.playing.value, player.scrubbed.value] = [false, true])}
        onInput={(event) => player.seek(event.currentTarget.valueAsNumber)}
      />
      <div class="timeline-metres small quiet" aria-hidden="true">
        {ticks({ low: 0, high: period_m, kind: "linear" }, 6).map((range_m) => (
          <span key={range_m} style={{ left: `${(100 * range_m) / period_m}%` }}>
            {fixed(range_m, 0, "m")}
          </span>
        ))}
      </div>
      <div class="timeline-ticks small quiet" aria-hidden="true">
        {marks.map((time_ns, at) => (
          <span key={time_ns} style={{ left: `${(100 * time_ns) / period_ns}%` }}>
            {fixed(time_ns, 0, at === marks.length - 1 ? "ns" : "")}
          </span>
        ))}
      </div>
    </div>
  );
}

/** The time of flight in words: when, how far the light has come, and the range that would be. */
export function TimeReadout() {
  const { player } = useStore();
  const time = useRef<HTMLOutputElement>(null);
  const range = useRef<HTMLSpanElement>(null);
  useDrawing(() => {
    const time_s = player.time_s.value;
    if (time.current !== null) time.current.textContent = fixed(time_s * 1e9, 2, "ns");
    if (range.current !== null) range.current.textContent = fixed(rangeOfTime_m(time_s), 2, "m");
  }, [player]);
  return (
    <p class="readout">
      <output ref={time} class="readout-value readout-time" data-field="time" aria-live="off" />
      <span title="Where light comes from that goes there and back in this time">
        <span class="quiet">range</span> <span ref={range} data-field="range" />
      </span>
    </p>
  );
}

function drawCurve(context: CanvasRenderingContext2D, arrivals: Float32Array): void {
  const { width, height } = context.canvas;
  const top = Math.max(...arrivals);
  context.clearRect(0, 0, width, height);
  if (!(top > 0)) return;
  context.fillStyle = getComputedStyle(context.canvas).color;
  context.beginPath();
  context.moveTo(0, height);
  for (let n = 0; n <= arrivals.length; n++) {
    const share = arrivals[n % arrivals.length] / top;
    context.lineTo((width * n) / arrivals.length, height - (height - 1) * Math.sqrt(share));
  }
  context.lineTo(width, height);
  context.fill();
}
