import { useComputed } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { rangeOfTime_m } from "../../physics/constants";
import { fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import { useDrawing } from "../../ui/hooks";
import { Ticks } from "../../ui/Ticks";
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
    const release = (): void => void (player.scrubbed.value = false);
    for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, release);
    return () => {
      for (const end of ["pointerup", "pointercancel"]) window.removeEventListener(end, release);
      release();
    };
  }, [player]);

  return (
    <div class="timeline">
      <canvas ref={canvas} width={CURVE_WIDTH} height={CURVE_HEIGHT} aria-hidden="true" />
      {player.arrivals.value.map((turn) => (
        <i key={turn} class="timeline-arrival" style={{ left: `${100 * turn}%` }} />
      ))}
      <i ref={head} class="timeline-head playhead" />
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
      <Ticks class="timeline-metres" side="left" end={rangeOfTime_m(period_s.value)} write={(range_m) => fixed(range_m, 0, "m")} />
      <Ticks
        class="timeline-ticks"
        side="left"
        end={period_s.value * 1e9}
        write={(time_ns, isLast) => fixed(time_ns, 0, isLast ? "ns" : "")}
      />
    </div>
  );
}

/** The time of flight in words: when, how far the light has come, and the range that would be. */
export function TimeReadout() {
  const { time_s } = useStore().player;
  return (
    <p class="readout line">
      <output class="readout-value readout-time strong" data-field="time" aria-live="off">
        {useComputed(() => fixed(time_s.value * 1e9, 2, "ns"))}
      </output>
      <span title="Where light comes from that goes there and back in this time">
        <span class="quiet">range</span> <span data-field="range">{useComputed(() => fixed(rangeOfTime_m(time_s.value), 2, "m"))}</span>
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
