import { engineering, fixed, grouped } from "../../scales/format";
import { useStore } from "../../store/store";
import type { AppliedDocument, ChoiceDocument, FigureDocument, WithinDocument } from "../../stream/documents";
import { measuredOf, TAKE_ORDER_NAMES, ZEROTH_NAMES } from "./words";
import "./Figures.css";

/** The sequence in use, and what follows from it. */
export function Summary({ applied }: { applied: AppliedDocument }) {
  const estimator = useStore().status.newest.value?.estimator;
  return (
    <dl class="facts">
      <Fact {...measuredOf(applied)} field="harmonics" strong />
      <Fact name="Exposure" value={engineering(applied.exposure_s, "s")} field="exposure_s" strong />
      <Fact
        name="Takes"
        value={applied.takes > 1 ? `${applied.takes}, ${TAKE_ORDER_NAMES[applied.take_order]}` : String(applied.takes)}
        field="takes"
        strong
      />
      <Fact name="Base frequency" value={engineering(applied.base_frequency_hz, "Hz", 4)} field="base_frequency_hz" />
      <Fact name="Zeroth moment" value={ZEROTH_NAMES[applied.zeroth]} field="zeroth" />
      <Fact name="Unambiguous range" value={fixed(applied.unambiguous_range_m, 2, "m")} field="unambiguous_range_m" />
      {estimator !== undefined && <Fact name="Range by" value={estimator.replaceAll("-", " ")} field="estimator" />}
      <Figures applied={applied} />
    </dl>
  );
}

/** The error of the median pixel, and of the worst but a tenth. */
function bothWords({ median, p90 }: FigureDocument): string {
  return `${engineering(median, "m", 2)}, ${engineering(p90, "m", 2)}`;
}

/** How many pixels of a capture are within the target, or within what those of the goal are. */
function withinWords({ share, error_m, target_m, target_share }: WithinDocument): { readonly name: string; readonly value: string } {
  const met = target_m != null && target_share != null;
  return {
    name: `Pixels within ${engineering(met ? target_m : error_m, "m", 2)}`,
    value: fixed(100 * (met ? target_share : share), 0, "%"),
  };
}

/** A sequence that is looked at, and what is predicted of it. */
export function ChoiceFacts({ choice }: { choice: ChoiceDocument }) {
  const { sequence, predicted } = choice;
  const { low, high } = predicted.range_error_m;
  const bias = engineering(predicted.range_bias_m, "m");
  const doubt = predicted.bias_known ? "" : ` – unknown, the look allows ${engineering(predicted.range_bias_most_m, "m", 2)}`;
  return (
    <dl class="facts" data-field="choice">
      <Fact {...measuredOf(sequence)} field="choice_harmonics" strong />
      <Fact name="Exposure" value={engineering(sequence.exposure_s, "s")} field="choice_exposure_s" strong />
      <Fact name="Takes" value={String(sequence.takes)} field="choice_takes" strong />
      <Fact name="Base frequency" value={engineering(sequence.base_frequency_hz, "Hz", 4)} field="choice_base_frequency_hz" />
      <Fact name="Zeroth moment" value={ZEROTH_NAMES[sequence.zeroth]} field="choice_zeroth" />
      <Fact name="Range by" value={choice.estimator.replaceAll("-", " ")} field="choice_estimator" />
      <Fact
        name="Error, 90 % within"
        value={high === null ? `at least ${engineering(low, "m", 2)}` : `${engineering(low, "m", 2)} to ${engineering(high, "m", 2)}`}
        field="choice_range_error_interval_m"
      />
      <Fact name="of that noise" value={engineering(predicted.range_std_m.median, "m")} field="choice_range_std_m" />
      <Fact name="of that bias" value={bias + doubt} field="choice_range_bias_m" />
      <Fact name="Error in 50, 90 % of pixels" value={bothWords(predicted.range_error_m)} field="choice_range_error_p90_m" />
      {predicted.within != null && <Fact {...withinWords(predicted.within)} field="choice_within" />}
    </dl>
  );
}

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

type FactProps = Readonly<{ name: string; value: string; field: string; strong?: boolean }>;

/** One named fact. */
export function Fact({ name, value, field, strong = false }: FactProps) {
  return (
    <div class={strong ? "fact fact-strong" : "fact"}>
      <dt class="small quiet">{name}</dt>
      <dd data-field={field}>{value}</dd>
    </div>
  );
}
