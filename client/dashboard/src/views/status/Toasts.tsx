import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import type { Happening } from "../../store/events";
import { useStore } from "../../store/store";
import "./Toasts.css";

/** How long a notice stays, one that something can be done about longer; and how many are seen together. */
const STAYS_S = 6;
const STAYS_TO_ACT_S = 20;
const MOST = 2;

/** What just happened, in the free part of the header: never over what can be pressed. It goes away by itself. */
export function Toasts() {
  const { events } = useStore();
  const now_s = useSignal(Date.now() / 1000);
  const all = events.all.value;
  const fresh = all.filter((each) => now_s.value < endOf(each)).slice(-MOST);
  const soonest_s = fresh.length === 0 ? null : Math.min(...fresh.map(endOf));
  useEffect(() => {
    now_s.value = Date.now() / 1000;
  }, [all, now_s]);
  useEffect(() => {
    if (soonest_s === null) return undefined;
    const timer = setTimeout(() => (now_s.value = Date.now() / 1000), 1000 * Math.max(0.1, soonest_s - Date.now() / 1000));
    return () => clearTimeout(timer);
  }, [soonest_s, now_s]);
  return (
    <div class="toasts column small" role="log" aria-label="What just happened">
      {fresh.map(({ number, words, tone, remedy }) => (
        <p key={number} class={`toast row toast-${tone}`} title={words}>
          <span class="toast-words clipped">{words}</span>
          {remedy !== undefined && (
            <button type="button" class="link" onClick={remedy.run}>
              {remedy.word}
            </button>
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
