import { useSignal } from "@preact/signals";

import { useStore } from "../../store/store";
import type { AppliedSequence } from "../../stream/protocol";
import { engineering, fixed } from "../../ui/format";
import { Panel } from "../../ui/Panel";
import { Steer } from "../../ui/Steer";
import { Fact, Figures } from "./Figures";
import { SequenceEditor } from "./SequenceEditor";
import { TAKE_ORDER_NAMES, ZEROTH_NAMES } from "./words";

/** What the camera measures with, and the way to change it. */
export function SequenceView() {
  const { sequence } = useStore();
  const editing = useSignal(false);
  const applied = sequence.value;
  return (
    <Panel
      name="sequence"
      title={<h2>Sequence</h2>}
      tools={
        applied !== null &&
        !editing.value && (
          <Steer title="Change what the camera measures with" onClick={() => (editing.value = true)}>
            Edit
          </Steer>
        )
      }
    >
      {applied === null ? (
        <p class="stage-empty">Not known yet</p>
      ) : editing.value ? (
        <SequenceEditor applied={applied} onDone={() => (editing.value = false)} />
      ) : (
        <Summary applied={applied} />
      )}
    </Panel>
  );
}

function Summary({ applied }: { applied: AppliedSequence }) {
  return (
    <dl class="facts">
      <Fact name="Base frequency" value={engineering(applied.base_frequency_hz, "Hz", 4)} field="base_frequency_hz" />
      <Fact name="Harmonics m" value={String(applied.harmonics)} field="harmonics" />
      <Fact name="Unambiguous range" value={fixed(applied.unambiguous_range_m, 2, "m")} field="unambiguous_range_m" strong />
      <Fact name="Zeroth moment" value={ZEROTH_NAMES[applied.zeroth]} field="zeroth" />
      <Fact name="Exposure" value={engineering(applied.exposure_s, "s")} field="exposure_s" />
      <Fact name="Takes" value={applied.takes > 1 && applied.take_order !== undefined ? `${applied.takes}, ${TAKE_ORDER_NAMES[applied.take_order] ?? applied.take_order}` : String(applied.takes)} field="takes" />
      <Figures applied={applied} />
    </dl>
  );
}
