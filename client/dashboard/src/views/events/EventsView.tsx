import { timeOfDay } from "../../scales/format";
import { useStore } from "../../store/store";
import { Panel } from "../../ui/Panel";
import "./EventsView.css";

/** What happened since the page was opened, the newest first. */
export function EventsView() {
  const { events } = useStore();
  const all = [...events.all.value].reverse();
  return (
    <Panel>
      <div class="panel-body column grow fades">
        {all.length === 0 && <p class="quiet recordings-none">Nothing worth telling since the page was opened.</p>}
        <ul class="events fades" tabIndex={0} aria-label="What happened">
          {all.map(({ number, at_s, words, tone }) => (
            <li key={number} class={tone === "bad" ? "event bad" : "event"}>
              <time class="quiet">{timeOfDay(at_s)}</time> {words}
            </li>
          ))}
        </ul>
      </div>
    </Panel>
  );
}
