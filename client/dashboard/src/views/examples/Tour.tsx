import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { OVERVIEW, viewsOf } from "../../store/layout";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import "./Tour.css";

/** The panel that is pointed at, or the bar, and what is said of it. */
const STEPS: readonly (readonly [place: string, words: string])[] = [
  [
    "transient",
    "A lamp flickers many million times a second, and the camera measures how light of several frequencies comes back. From that the " +
      "service computes when light arrived at each pixel. This picture plays it: Space pauses, the arrow keys move by 0.1 ns.",
  ],
  [
    "map",
    "The range of each pixel: how far its first light came. Point at a pixel to read it, with its 90 % interval. Direct and Indirect " +
      "part the light that came at once from light that took a longer way.",
  ],
  [
    "response",
    "The light of one pixel over time; click another pixel to see its own. Each peak is a return. The band holds every smoothed curve " +
      "that has the measured moments; what noise adds stands in the table.",
  ],
  ["sequence", "What accuracy costs: Predict weighs other sequences for this scene, then the slider chooses between fast and accurate."],
  [
    "bar",
    "Take control before you change the camera. The arrow out of the box copies a link to this very frame. Light off works for everybody, " +
      "at any time.",
  ],
];

/** A walk past the panels of the page, beside them: nothing is covered or changed but the layout. */
export function Tour({ onDone }: Done) {
  const store = useStore();
  const at = useSignal(0);
  const [place, words] = STEPS[at.value];
  useEffect(() => {
    store.alone.value = null;
    if (!STEPS.every(([each]) => each === "bar" || viewsOf(store.layout.peek()).includes(each))) store.showLayout(OVERVIEW);
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
