import { useRef } from "preact/hooks";
import { engineering, fixed } from "../../scales/format";
import type { ChoiceDocument } from "../../stream/documents";
import { sameSequence, stepOf } from "./place";
import "./FrontSlider.css";

interface FrontSliderProps {
  /** By rising time and falling error. */
  readonly front: readonly ChoiceDocument[];
  /** Time of a capture with the sequence in use. */
  readonly now_s: number;
  readonly looked: ChoiceDocument | null;
  readonly onLook: (choice: ChoiceDocument) => void;
  /** The slider was let go at what is looked at. */
  readonly onRelease: () => void;
}

/** Keys that move a slider; the page's own shortcuts are not meant then. */
const MOVING: readonly string[] = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];

/** From fast to accurate along the front, a step a point; where the camera stands now is marked on it. */
export function FrontSlider({ front, now_s, looked, onLook, onRelease }: FrontSliderProps) {
  const moved = useRef(false);
  const key = useRef(false);
  const release = (): void => {
    key.current = false;
    if (!moved.current) return;
    moved.current = false;
    onRelease();
  };
  const last = front.length - 1;
  const ghost = last < 1 ? null : stepOf(front, now_s);
  const at = front.findIndex((choice) => sameSequence(choice, looked));
  const step = at >= 0 ? at : looked !== null && last > 0 ? Math.round(stepOf(front, looked.capture_s)) : Math.round(ghost ?? 0);
  return (
    <div class="row quiet">
      <span aria-hidden="true">fast</span>
      <div class="front-track grow">
        {ghost !== null && <i class="front-ghost" data-field="ghost" style={{ "--place": ghost / last }} title="The present setting" />}
        <input
          type="range"
          min={0}
          max={Math.max(1, last)}
          step={1}
          value={step}
          disabled={last < 1}
          aria-label="From fast to accurate"
          aria-valuetext={last < 1 ? "Not predicted yet" : choiceWords(at < 0 && looked !== null ? looked : front[step])}
          onInput={(event) => {
            moved.current = true;
            onLook(front[event.currentTarget.valueAsNumber]);
          }}
          onChange={() => {
            if (!key.current) release();
          }}
          onKeyDown={(event) => {
            if (!MOVING.includes(event.key)) return;
            event.stopPropagation();
            key.current = true;
          }}
          onKeyUp={release}
          onBlur={release}
        />
      </div>
      <span aria-hidden="true">accurate</span>
    </div>
  );
}

/** What a choice gives and takes: "± 4.0 mm in 94 ms, 10.6 Hz". */
function choiceWords(choice: ChoiceDocument): string {
  return `± ${engineering(choice.predicted.range_error_m.median, "m", 2)} in ${engineering(choice.capture_s, "s", 2)}, ${fixed(choice.frame_rate_hz, 1, "Hz")}`;
}
