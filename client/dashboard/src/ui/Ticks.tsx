import { ticks } from "../scales/scale";
import "./Ticks.css";

interface TicksProps {
  readonly class: string;
  /** From which side of the picture places are counted. */
  readonly side: "left" | "top";
  /** The value at the other side; zero is at this one. */
  readonly end: number;
  readonly write: (value: number, isLast: boolean) => string;
}

/** Round numbers along a side of a picture. */
export function Ticks({ class: kind, side, end, write }: TicksProps) {
  const values = ticks({ low: 0, high: end, kind: "linear" }, 6);
  return (
    <div class={`${kind} ticks small quiet`} aria-hidden="true">
      {values.map((value, n) => (
        <span key={value} style={{ [side]: `${(100 * value) / end}%` }}>
          {write(value, n === values.length - 1)}
        </span>
      ))}
    </div>
  );
}
