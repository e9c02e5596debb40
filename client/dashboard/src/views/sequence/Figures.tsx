import { engineering, fixed, grouped } from "../../scales/format";
import type { AppliedDocument } from "../../stream/documents";
import "./Figures.css";

/** The figures that follow from a sequence; shown for the one in use and for one being edited. */
export function Figures({ applied }: { applied: AppliedDocument }) {
  return (
    <>
      <Fact name="Images" value={grouped(applied.images)} field="images" />
      <Fact name="Capture time" value={engineering(applied.capture_s, "s")} field="capture_s" strong />
      <Fact name="Frame rate" value={fixed(applied.frame_rate_hz, applied.frame_rate_hz < 10 ? 2 : 1, "Hz")} field="frame_rate_hz" strong />
      <Fact name="Raw data" value={engineering(applied.data_rate_bytes_s, "B/s")} field="data_rate_bytes_s" />
    </>
  );
}

interface FactProps {
  readonly name: string;
  readonly value: string;
  readonly field: string;
  readonly strong?: boolean;
}

/** One named fact. */
export function Fact({ name, value, field, strong = false }: FactProps) {
  return (
    <div class={strong ? "fact fact-strong" : "fact"}>
      <dt>{name}</dt>
      <dd data-field={field}>{value}</dd>
    </div>
  );
}
