import type { Happening } from "../../store/events";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import { useNow } from "../../ui/hooks";
import "./Toasts.css";

/** How long a notice stays, one that something can be done about longer; and how many are seen together. */
const STAYS_S = 6;
const STAYS_TO_ACT_S = 20;
const MOST = 2;

/** What just happened, in the free part of the header: never over what can be pressed. It goes away by itself. */
export function Toasts() {
  const { events } = useStore();
  const now_s = useNow(1);
  const fresh = events.all.value.filter((each) => now_s < endOf(each)).slice(-MOST);
  return (
    <div class="toasts column grow small" role="log" aria-label="What just happened">
      {fresh.map(({ number, words, tone, remedy }) => (
        <p key={number} class="toast row" title={words}>
          <i class={`dot ${tone}`} aria-hidden="true" />
          <span class="clipped">{words}</span>
          {remedy !== undefined && (
            <Button class="link" onClick={remedy.run}>
              {remedy.word}
            </Button>
          )}
        </p>
      ))}
    </div>
  );
}

/** When a notice goes away. */
function endOf({ at_s, remedy }: Happening): number {
  return at_s + (remedy === undefined ? STAYS_S : STAYS_TO_ACT_S);
}
