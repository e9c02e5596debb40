import { type ReadonlySignal, useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";

import { beyond, type ColourMapName, colourTable, LEVELS, levelOf } from "../scales/colourMaps";
import { fixed, significant, withUnit } from "../scales/format";
import { decimalsFor, fraction, histogram, niceStep, type Scale, type Span, ticks, valueAt } from "../scales/scale";
import type { Look } from "../store/looks";
import { useStore } from "../store/store";
import { useComputedOf, useDrawing } from "./hooks";
import "./Ticks.css";
import "./ColourBar.css";

/** Share of the scale's length that the bar goes on beyond either end: for what lies there, and for handles to be drawn to. */
const MARGIN = 0.1;
const LENGTH = 1 + 2 * MARGIN;
/** Rows of the canvas; bins of the histogram. */
const ROWS = 240;
const BINS = 60;
const COLOURS_PX = 12;
const HISTOGRAM_PX = 20;
/** Least distance of the handles, and what one press of an arrow key moves, in shares of the scale. */
const NEAREST = 0.02;
const KEY_STEP = 0.01;

interface ColourBarProps {
  readonly scale: Scale;
  readonly colours: ColourMapName;
  readonly unit: string;
  /** What is coloured, for the histogram; null before there is something. */
  readonly values?: ReadonlySignal<{ readonly values: ArrayLike<number> } | null>;
  /** The value under the pointer, marked on the bar. */
  readonly marked?: ReadonlySignal<number>;
  /** Sets the ends of the scale, null to let them follow the data; absent where they cannot be set. */
  readonly onLimit?: (limits: Span | null) => void;
}

/** Place of a value on the bar, from its foot (0) to its top (1). */
export function onBar(scale: Scale, value: number): number {
  return (fraction(scale, value) + MARGIN) / LENGTH;
}

/**
 * The limits after the handle at one end was drawn to a place of the bar, 0 to 1.
 *
 * A handle stops before the other: a scale has a low end and a high one.
 */
export function drawn(scale: Scale, end: keyof Span, place: number): Span {
  const share = place * LENGTH - MARGIN;
  const { low, high } = { low: valueAt(scale, 0), high: scale.high };
  return end === "low"
    ? { low: valueAt(scale, Math.min(1 - NEAREST, share)), high }
    : { low, high: valueAt(scale, Math.max(NEAREST, share)) };
}

/** The colour scale of a picture: its numbers, how often each value occurs, and handles at both ends. */
export function ColourBar({ scale, colours, unit, values, marked, onLimit }: ColourBarProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  /** The scale that a drag began with: the bar stands still under the pointer. */
  const held = useSignal<Scale | null>(null);
  const base = held.value ?? scale;

  useDrawing(() => {
    const context = canvas.current?.getContext("2d");
    if (context) paintBar(context, base, scale, colours, values?.value?.values);
  }, [base, scale, colours, values]);

  const marker = useComputedOf([base, marked], () => {
    const place = onBar(base, marked?.value ?? NaN);
    return Number.isNaN(place) ? null : `${100 * Math.min(1, Math.max(0, place))}%`;
  });
  const numbers = ticks(base, 6);
  const decimals = decimalsFor(niceStep(base.high - base.low, 6));
  const write = (value: number): string => (base.kind === "linear" ? fixed(value, decimals) : significant(value, 1));
  const ends = onLimit === undefined ? [] : (["low", "high"] as const);
  return (
    <div
      class={`colour-bar column ${values === undefined ? "colour-bar-bare" : ""}`}
      role="group"
      aria-label={`Colour scale from ${write(scale.low)} to ${withUnit(write(scale.high), unit)}`}
    >
      <p class="colour-bar-unit small quiet">{unit === "1" ? "" : unit}</p>
      <div
        class="colour-bar-body grow"
        title={onLimit === undefined ? undefined : "Drag the handles; double click lets the ends follow the data"}
        onDblClick={() => onLimit?.(null)}
      >
        <canvas
          ref={canvas}
          class="cover quiet"
          width={COLOURS_PX + (values === undefined ? 0 : HISTOGRAM_PX)}
          height={ROWS}
          aria-hidden="true"
        />
        {numbers.map((value) => (
          <span key={value} class="colour-bar-tick tick small quiet" style={{ bottom: `${100 * onBar(base, value)}%` }}>
            {write(value)}
          </span>
        ))}
        {marker.value !== null && <i class="colour-bar-marker" style={{ bottom: marker.value }} />}
        {ends.map((end) => (
          <Handle key={end} end={end} base={base} scale={scale} text={write(scale[end])} unit={unit} held={held} onLimit={onLimit} />
        ))}
      </div>
    </div>
  );
}

/** The colour bar of a map, which sets its limits; as wide without one. */
export function MapBar({ look, marked, values }: { look: Look | null; marked?: ReadonlySignal<number>; values?: Look["frame"] }) {
  const { looks } = useStore();
  if (look === null) return <div class="colour-bar" />;
  return (
    <ColourBar
      scale={look.scale.value}
      colours={look.colours.value}
      unit={look.product.unit}
      values={values ?? look.frame}
      {...(marked === undefined ? {} : { marked })}
      onLimit={(limits) => looks.limit(look, limits)}
    />
  );
}

interface HandleProps {
  readonly end: keyof Span;
  readonly base: Scale;
  readonly scale: Scale;
  readonly text: string;
  readonly unit: string;
  readonly held: { value: Scale | null };
  readonly onLimit: ((limits: Span) => void) | undefined;
}

/** One end of the scale, to be dragged or moved by arrow keys. */
function Handle({ end, base, scale, text, unit, held, onLimit }: HandleProps) {
  const move = (place: number): void => onLimit?.(drawn(base, end, place));
  return (
    <i
      class={`colour-bar-handle colour-bar-${end}`}
      role="slider"
      tabIndex={0}
      aria-label={`${end === "low" ? "Lower" : "Upper"} handle of the scale`}
      aria-orientation="vertical"
      aria-valuenow={scale[end]}
      aria-valuetext={withUnit(text, unit)}
      style={{ bottom: `${100 * onBar(base, scale[end])}%` }}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        held.value = scale;
      }}
      onPointerMove={(event) => {
        if (!event.currentTarget.hasPointerCapture(event.pointerId)) return;
        const body = event.currentTarget.parentElement?.getBoundingClientRect();
        if (body !== undefined) move((body.bottom - event.clientY) / body.height);
      }}
      onLostPointerCapture={() => (held.value = null)}
      onKeyDown={(event) => {
        const step = { ArrowUp: KEY_STEP, ArrowDown: -KEY_STEP }[event.key];
        if (step === undefined) return;
        event.preventDefault();
        event.stopPropagation();
        move(onBar(base, scale[end]) + step / LENGTH);
      }}
    />
  );
}

/** Colours at the left, those beyond the scale only where there are values that may lie there; at the right how often each value occurs; both from the foot upwards. */
function paintBar(context: CanvasRenderingContext2D, base: Scale, scale: Scale, colours: ColourMapName, values?: ArrayLike<number>): void {
  const table = colourTable(colours);
  const { under, over } = beyond(colours);
  const { width, height } = context.canvas;
  context.clearRect(0, 0, width, height);
  for (let row = 0; row < height; row++) {
    const place = fraction(scale, valueAt(base, (1 - (row + 0.5) / height) * LENGTH - MARGIN));
    const level = 4 * Math.min(LEVELS - 1, levelOf(place));
    context.fillStyle =
      values !== undefined && place < 0
        ? css(under)
        : values !== undefined && place > 1
          ? css(over)
          : `rgb(${table[level]} ${table[level + 1]} ${table[level + 2]})`;
    context.fillRect(0, row, COLOURS_PX, 1);
  }
  if (values === undefined) return;
  const counts = histogram(values, base, BINS, -MARGIN, 1 + MARGIN);
  const most = Math.max(1, ...counts);
  context.fillStyle = getComputedStyle(context.canvas).color;
  counts.forEach((count, bin) => {
    // The root keeps rare values in sight.
    const length = (HISTOGRAM_PX - 2) * Math.sqrt(count / most);
    context.fillRect(COLOURS_PX + 2, (1 - (bin + 1) / BINS) * height, length, height / BINS);
  });
}

function css(rgba: number): string {
  return `rgb(${rgba & 255} ${(rgba >> 8) & 255} ${(rgba >> 16) & 255})`;
}
