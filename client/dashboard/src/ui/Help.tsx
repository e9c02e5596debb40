import { useStore } from "../store/store";
import { SwitchedDialog } from "./Dialog";
import { SHORTCUTS } from "./shortcuts";
import "./Help.css";

/** The keys of the page, over the page. */
export function Help() {
  return (
    <SwitchedDialog open={useStore().help} title="Keys">
      {(close) => <KeyList onDone={close} />}
    </SwitchedDialog>
  );
}

function KeyList({ onDone }: { onDone: () => void }) {
  return (
    <>
      <dl class="keys">
        {SHORTCUTS.map(({ shown, words }) => (
          <div key={shown}>
            <dt>
              <kbd>{shown}</kbd>
            </dt>
            <dd>{words}</dd>
          </div>
        ))}
        <div>
          <dt>
            <kbd>Shift</kbd> + arrows
          </dt>
          <dd>in a picture: move the selected pixel</dd>
        </div>
        <div>
          <dt>wheel, + −</dt>
          <dd>in a picture: zoom all pictures; a double click shows them whole</dd>
        </div>
        <div>
          <dt>
            <kbd>Shift</kbd> + click, <kbd>Enter</kbd>
          </dt>
          <dd>in a picture: pin a pixel as A, B or C</dd>
        </div>
        <div>
          <dt>
            <kbd>Shift</kbd> + drag, <kbd>R</kbd>
          </dt>
          <dd>in a picture: measure a rectangle; Escape removes it and the pins</dd>
        </div>
        <div>
          <dt>
            <kbd>Ctrl</kbd> + click, <kbd>C</kbd>
          </dt>
          <dd>in a picture: set or remove a corner of a polygon, and measure it</dd>
        </div>
        <div>
          <dt>arrows, + −</dt>
          <dd>in the points: turn, come nearer, go</dd>
        </div>
      </dl>
      <div class="dialog-actions">
        <button type="button" onClick={onDone}>
          Close
        </button>
      </div>
    </>
  );
}
