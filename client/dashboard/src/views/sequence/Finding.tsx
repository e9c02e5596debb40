import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import type { Task } from "../../ui/useTask";
import { goalWords } from "./words";
import "./Finding.css";

const HINT = "Predict shows what each sequence would give on this scene: some seconds of work for the service.";

/** How far the service is with what was asked, and the way to end it; else what came of it, or of setting a sequence. Its height stays. */
export function Finding({ task }: { task: Task }) {
  const { accuracy } = useStore();
  const job = accuracy.job.value;
  const problem = accuracy.problem.value;
  if (job !== null) {
    const share = `${Math.round(100 * job.progress)}\u202f%`;
    return (
      <div class="finding row" role="status" data-field="accuracy-status">
        <progress value={job.progress} aria-label={job.kind === "tradeoff" ? "Prediction" : "Plan"} />
        <span class="finding-words">
          {share} <span class="quiet">{job.step}</span>
        </span>
        <Button onClick={() => void accuracy.cancel()}>Cancel</Button>
      </div>
    );
  }
  const refusal = task.refusal.value ?? (problem === null ? null : goalWords(problem));
  const found = accuracy.outdated.value ? "The scene changed since: predict again." : (accuracy.tradeoff.value?.summary ?? HINT);
  return (
    <p class={`finding row ${refusal === null ? "quiet" : "refusal"}`} role="status" data-field="accuracy-status">
      {task.busy.value ?? refusal ?? found}
    </p>
  );
}
