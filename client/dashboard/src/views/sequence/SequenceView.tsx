import { useSignal } from "@preact/signals";
import type { Accuracy } from "../../store/accuracy";
import { useStore } from "../../store/store";
import type { FrameDocument } from "../../stream/documents";
import { Button } from "../../ui/controls";
import { saveTable } from "../../ui/download";
import { captionOf } from "../../ui/figure";
import { Panel } from "../../ui/Panel";
import { Steer } from "../../ui/Steer";
import { AccuracySection } from "./AccuracySection";
import { SequenceEditor } from "./SequenceEditor";

/** What the camera measures with, what accuracy that gives, and the ways to change it. */
export function SequenceView() {
  const { sequence, sequencing, accuracy } = useStore();
  const editing = useSignal(false);
  const applied = sequence.value;
  const found = accuracy.tradeoff.value;
  const words = (meta: FrameDocument) => ({
    name: "front",
    title: "Error of the range against time of a capture",
    caption: captionOf(meta, applied),
  });
  return (
    <Panel
      plot={found === null || editing.value ? undefined : () => words(found.current.meta)}
      downloads={found === null ? [] : [{ text: "Front (CSV)", run: () => saveTable("front", frontTable(accuracy)) }]}
      tools={
        applied !== null &&
        !editing.value && (
          <>
            {sequencing.undoable.value && (
              <Steer title="Return to the sequence before" onClick={() => void sequencing.undo()}>
                Undo
              </Steer>
            )}
            <Button
              title="What accuracy costs in time on the scene before the camera, now"
              disabled={accuracy.job.value !== null}
              onClick={() => void accuracy.predict()}
            >
              Predict
            </Button>
            <Steer title="Change what the camera measures with" onClick={() => (editing.value = true)}>
              Edit
            </Steer>
          </>
        )
      }
    >
      {applied === null ? (
        <p class="stage-empty cover">Not known yet</p>
      ) : editing.value ? (
        <SequenceEditor applied={applied} onDone={() => (editing.value = false)} />
      ) : (
        <AccuracySection applied={applied} />
      )}
    </Panel>
  );
}

/** The front that was predicted, a row a sequence. */
function frontTable({ tradeoff }: Accuracy) {
  const names = ["capture_s", "range_error_median_m", "range_error_low_m", "range_error_high_m", "harmonics", "exposure_s", "takes"];
  const rows = (tradeoff.peek()?.front ?? []).map(({ capture_s, predicted: { range_error_m }, sequence }) => {
    const { median, low, high } = range_error_m;
    return [capture_s, median, low, high, sequence.harmonics, sequence.exposure_s, sequence.takes];
  });
  return [names, ...rows];
}
