import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import { useStore } from "../../store/store";

/** How long a notice stays, and how many are seen together. */
const STAYS_S = 6;
const MOST = 2;

/** What just happened, in the free part of the header: never over what can be pressed. It goes away by itself. */
export function Toasts() {
  const { events } = useStore();
  const now_s = useSignal(Date.now() / 1000);
  const all = events.all.value;
  const fresh = all.filter(({ at_s }) => now_s.value - at_s < STAYS_S).slice(-MOST);
  const oldest_s = fresh[0]?.at_s;
  useEffect(() => {
    now_s.value = Date.now() / 1000;
  }, [all, now_s]);
  useEffect(() => {
    if (oldest_s === undefined) return undefined;
    const timer = setTimeout(() => (now_s.value = Date.now() / 1000), 1000 * Math.max(0.1, oldest_s + STAYS_S - Date.now() / 1000));
    return () => {
      clearTimeout(timer);
    };
  }, [oldest_s, now_s]);
  return (
    <div class="toasts" role="log" aria-label="What just happened">
      {fresh.map(({ number, words, tone }) => (
        <p key={number} class={`toast toast-${tone}`} title={words}>
          {words}
        </p>
      ))}
    </div>
  );
}
