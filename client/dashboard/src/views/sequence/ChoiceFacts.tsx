import { engineering, fixed } from "../../scales/format";
import type { ChoiceDocument } from "../../stream/documents";
import { Fact } from "./Figures";
import { measuredOf, ZEROTH_NAMES } from "./words";

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
        value={`${engineering(low, "m", 2)} to ${engineering(high, "m", 2)}`}
        field="choice_range_error_interval_m"
      />
      <Fact name="of that noise" value={engineering(predicted.range_std_m.median, "m")} field="choice_range_std_m" />
      <Fact name="of that bias" value={bias + doubt} field="choice_range_bias_m" />
      <Fact name="Outliers" value={fixed(100 * predicted.outlier_share, 1, "%")} field="choice_outlier_share" />
    </dl>
  );
}
