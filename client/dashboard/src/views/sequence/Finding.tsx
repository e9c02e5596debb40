import { useStore } from "../../store/store";
import { NOTHING } from "../../ui/format";
import { goalWords } from "./goals";

/** How far the service is with what was asked, and the way to end it; else what came of it. Its height stays. */
export function Finding() {
  const { accuracy } = useStore();
  const job = accuracy.job.value;
  const problem = accuracy.problem.value;
  if (job !== null) {
    const share = `${Math.round(100 * job.progress)}\u202f%`;
    return (
      <div class="finding" role="status" data-field="accuracy-status">
        <progress value={job.progress} aria-label={job.kind === "tradeoff" ? "Prediction" : "Plan"} />
        <span class="finding-words">
          {share} <span class="quiet">{job.step}</span>
        </span>
        <button type="button" onClick={() => void accuracy.cancel()}>
          Cancel
        </button>
      </div>
    );
  }
  const words = problem !== null ? goalWords(problem) : accuracy.outdated.value ? "The scene changed since: predict again." : (accuracy.tradeoff.value?.summary ?? NOTHING);
  return (
    <p class={problem === null ? "finding quiet" : "finding refusal"} role="status" data-field="accuracy-status">
      {words}
    </p>
  );
}
