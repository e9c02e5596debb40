import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { OVERVIEW, viewsOf } from "../../store/layout";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import STEPS from "./tour.json";
import "./Tour.css";

/** A walk past the panels of the page, beside them: nothing is covered or changed but the layout. */
export function Tour({ onDone }: Done) {
  const store = useStore();
  const at = useSignal(0);
  const { place, words } = STEPS[at.value];
  useEffect(() => {
    store.alone.value = null;
    if (!STEPS.every(({ place: each }) => each === "bar" || viewsOf(store.layout.peek()).includes(each))) store.showLayout(OVERVIEW);
  }, [store]);
  useEffect(() => {
    document.documentElement.dataset.toured = place;
    return () => void delete document.documentElement.dataset.toured;
  }, [place]);
  const last = at.value === STEPS.length - 1;
  return (
    <section class="tour column spaced" aria-label="Tour" onKeyDown={({ key }) => key === "Escape" && onDone()}>
      <p role="status">{words}</p>
      <div class="row apart">
        <span class="quiet">
          {at.value + 1} of {STEPS.length}
        </span>
        <span class="row">
          {at.value > 0 && <Button onClick={() => at.value--}>Back</Button>}
          {!last && <Button onClick={onDone}>End</Button>}
          <Button autofocus onClick={() => (last ? onDone() : at.value++)}>
            {last ? "Done" : "Next"}
          </Button>
        </span>
      </div>
    </section>
  );
}
