import type { Store } from "../store/store";

/** Flight passed by one press of an arrow key, in s. */
const STEP_S = 0.1e-9;
const LONG_STEP_S = 1e-9;

/** Keys for the whole page; the answer takes them away again. */
export function shortcuts(target: Window, store: Store): () => void {
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey || typesText(event.target)) return;
    const action = actionOf(event, store);
    if (action === null) return;
    event.preventDefault();
    action();
  };
  target.addEventListener("keydown", onKeyDown);
  return () => {
    target.removeEventListener("keydown", onKeyDown);
  };
}

function actionOf(event: KeyboardEvent, { player, held }: Store): (() => void) | null {
  const scrub = (flight_s: number) => () => {
    player.playing.value = false;
    player.step(flight_s);
  };
  switch (event.key) {
    case " ":
      // A focused button is pressed by the space bar already.
      return event.target instanceof HTMLButtonElement ? null : () => { player.toggle(); }; // prettier-ignore
    case "ArrowRight":
      return scrub(event.shiftKey ? LONG_STEP_S : STEP_S);
    case "ArrowLeft":
      return scrub(event.shiftKey ? -LONG_STEP_S : -STEP_S);
    case "Home":
      return () => { player.seek(0); }; // prettier-ignore
    case "h":
      return () => (held.value = !held.peek());
    default:
      return null;
  }
}

/** Whether keys belong to what has the focus: text is typed there, or an option chosen. */
function typesText(target: EventTarget | null): boolean {
  if (target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) return true;
  return target instanceof HTMLInputElement && target.type !== "range";
}
