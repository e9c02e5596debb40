import { useRef } from "preact/hooks";
import { engineering, significant } from "../../scales/format";
import type { ChoiceDocument, TradeoffDocument } from "../../stream/documents";
import { useSize } from "../../ui/hooks";
import { endsOf, marksOf, nearest, placeOf, type Standing, sameSequence } from "./place";
import "./FrontPlot.css";

const MARGIN = { left: 52, right: 14, top: 14, bottom: 50 };

/** Least room of a number beside an axis. */
const LABEL_PX = { width: 48, height: 16 };

const STEPS: Readonly<Record<string, number | undefined>> = { ArrowRight: 1, ArrowLeft: -1, Enter: 0, " ": 0 };

interface FrontPlotProps {
  readonly tradeoff: TradeoffDocument;
  readonly now: Standing | null;
  readonly chosen: ChoiceDocument | null;
  readonly onChoose: (choice: ChoiceDocument) => void;
}

/** The Pareto front with its uncertainty, and where the camera stands now. Points are chosen by click or key. */
export function FrontPlot({ tradeoff, now, chosen, onChoose }: FrontPlotProps) {
  const box = useRef<HTMLDivElement>(null);
  const { width, height } = useSize(box).value;
  const ends = endsOf(tradeoff);
  const inner = { width: width - MARGIN.left - MARGIN.right, height: height - MARGIN.top - MARGIN.bottom };
  const x = (place: number): number => MARGIN.left + place * inner.width;
  const y = (place: number): number => MARGIN.top + (1 - place) * inner.height;
  const at = (capture_s: number, range_error_m: number): { x: number; y: number } => {
    const place = placeOf(ends, capture_s, range_error_m);
    return { x: x(place.x), y: y(place.y) };
  };
  const within = (place: { x: number; y: number }): { x: number; y: number } => ({
    x: Math.min(x(1), Math.max(x(0), place.x)),
    y: Math.min(y(0), Math.max(y(1), place.y)),
  });
  const points = tradeoff.front.map((choice) => ({ choice, ...at(choice.capture_s, choice.predicted.range_error_m.median) }));
  // One point is reached by Tab, the others from there by arrow keys.
  const reached = tradeoff.front.find((choice) => sameSequence(choice, chosen)) ?? tradeoff.front[0];
  const planned =
    chosen !== null && !tradeoff.front.some((choice) => sameSequence(choice, chosen))
      ? at(chosen.capture_s, chosen.predicted.range_error_m.median)
      : null;
  const here = now === null ? null : within(at(now.capture_s, now.range_error_m));
  return (
    <div class="front" ref={box}>
      {width > 0 && inner.height > 0 && (
        <svg
          class="plot cover"
          width={width}
          height={height}
          role="group"
          aria-label="Accuracy against capture time"
          onClick={(event) => {
            if (event.detail === 0) return;
            const edge = event.currentTarget.getBoundingClientRect();
            const near = nearest(points, event.clientX - edge.left, event.clientY - edge.top);
            if (near !== null) onChoose(near.choice);
          }}
        >
          {marksOf(ends.time, LABEL_PX.width / inner.width).map(({ value, place }) => (
            <g key={value} class="front-mark">
              <path d={`M${x(place)} ${MARGIN.top}v${inner.height}`} />
              <text x={x(place)} y={height - MARGIN.bottom + 14} text-anchor="middle">
                {engineering(value, "s", 1)}
              </text>
              <text x={x(place)} y={height - MARGIN.bottom + 28} text-anchor="middle">
                {significant(1 / value, 1, "Hz")}
              </text>
            </g>
          ))}
          {marksOf(ends.error, LABEL_PX.height / inner.height).map(({ value, place }) => (
            <g key={value} class="front-mark">
              <path d={`M${MARGIN.left} ${y(place)}h${inner.width}`} />
              <text x={MARGIN.left - 6} y={y(place) + 4} text-anchor="end">
                {engineering(value, "m", 1)}
              </text>
            </g>
          ))}
          <text class="front-axis" x={MARGIN.left + inner.width / 2} y={height - 4} text-anchor="middle">
            time of one capture, and captures a second
          </text>
          <text class="front-axis" x={width - MARGIN.right} y={MARGIN.top + 8} text-anchor="end">
            error of the range: noise and bias
          </text>
          <path class="front-line" d={points.map((point, n) => `${n === 0 ? "M" : "L"}${point.x} ${point.y}`).join("")} />
          {points.map(({ choice, ...point }) => {
            const { low, high, median } = choice.predicted.range_error_m;
            const words = `${engineering(choice.capture_s, "s")}, ${engineering(median, "m")}, m = ${choice.sequence.harmonics}`;
            return (
              <g
                key={choice.capture_s}
                class="front-point"
                role="button"
                tabindex={choice === reached ? 0 : -1}
                aria-label={words}
                aria-pressed={sameSequence(choice, chosen)}
                onClick={(event) => {
                  if (event.detail === 0) onChoose(choice); // by an assistive tool, without a place
                }}
                onKeyDown={(event) => {
                  const step = STEPS[event.key];
                  const next = step === undefined ? undefined : tradeoff.front[tradeoff.front.indexOf(choice) + step];
                  if (next === undefined) return;
                  event.preventDefault();
                  event.stopPropagation();
                  onChoose(next);
                  const other =
                    step === 1 ? event.currentTarget.nextElementSibling : step === -1 ? event.currentTarget.previousElementSibling : null;
                  if (other instanceof SVGElement) other.focus();
                }}
              >
                <title>{words}</title>
                <path d={`M${point.x} ${at(choice.capture_s, low).y}V${high === null ? MARGIN.top : at(choice.capture_s, high).y}`} />
                <circle class="front-reach" cx={point.x} cy={point.y} r="9" />
                <circle cx={point.x} cy={point.y} r="4" />
              </g>
            );
          })}
          {planned !== null && <circle class="front-planned" cx={planned.x} cy={planned.y} r="8" />}
          {here !== null && (
            <g class="front-now" data-field="now">
              <path d={`M${here.x - 8} ${here.y}h16M${here.x} ${here.y - 8}v16`} />
              <text x={here.x + 10} y={here.y - 8} text-anchor={here.x > 0.7 * width ? "end" : "start"}>
                now
              </text>
            </g>
          )}
        </svg>
      )}
    </div>
  );
}
