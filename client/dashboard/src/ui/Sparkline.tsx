import type { PlotPoint } from "../store/trends";
import "./Sparkline.css";

interface SparklineProps {
  /** Lines over the unit square. */
  readonly lines: readonly (readonly PlotPoint[])[];
  readonly label: string;
}

const [WIDTH, HEIGHT] = [88, 20];
/** Room for the width of the line. */
const EDGE = 1.5;

/** A figure over time as a line in a text's height; a single sample is a dot. */
export function Sparkline({ lines, label }: SparklineProps) {
  const place = ({ x, y }: PlotPoint): string =>
    `${(EDGE + x * (WIDTH - 2 * EDGE)).toFixed(1)} ${(HEIGHT - EDGE - y * (HEIGHT - 2 * EDGE)).toFixed(1)}`;
  // Of one point a line with round ends is a dot.
  const path = lines.map((line) => `M${line.map(place).join("L")}${line.length === 1 ? "h0" : ""}`).join("");
  return (
    <svg class="sparkline" width={WIDTH} height={HEIGHT} role="img" aria-label={label}>
      <title>{label}</title>
      <path d={path} />
    </svg>
  );
}
