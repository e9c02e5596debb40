import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import { useStore } from "../../store/store";

/** How long a notice stays, and how many are seen together. */
const STAYS_S = 7;
const MOST = 3;

/** What just happened, in a corner; it goes away by itself. */
export function Toasts() {
  const { events } = useStore();
  const now_s = useSignal(Date.now() / 1000);
  const seen = useSignal(0);
  const fresh = events.all.value.filter(({ number, at_s }) => number > seen.value && now_s.value - at_s < STAYS_S).slice(-MOST);
  const oldest_s = fresh[0]?.at_s;
  useEffect(() => {
    now_s.value = Date.now() / 1000;
  }, [events.all.value, now_s]);
  useEffect(() => {
    if (oldest_s === undefined) return undefined;
    const timer = setTimeout(() => (now_s.value = Date.now() / 1000), 1000 * Math.max(0.1, oldest_s + STAYS_S - Date.now() / 1000));
    return () => {
      clearTimeout(timer);
    };
  }, [oldest_s, now_s]);
  return (
    <div class="toasts" role="log" aria-label="What happened">
      {fresh.map(({ number, words, tone }) => (
        <p key={number} class={`toast toast-${tone}`}>
          <span>{words}</span>
          <button type="button" class="link" aria-label="Dismiss" onClick={() => (seen.value = number)}>
            ×
          </button>
        </p>
      ))}
    </div>
  );
}
