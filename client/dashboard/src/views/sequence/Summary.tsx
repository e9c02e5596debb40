import { engineering, fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { AppliedDocument } from "../../stream/documents";
import { Fact, Figures } from "./Figures";
import { measuredOf, TAKE_ORDER_NAMES, ZEROTH_NAMES } from "./words";

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
