import { useEffect, useRef } from "preact/hooks";

import { useStore } from "../store/store";
import { SHORTCUTS } from "./shortcuts";

/** The keys of the page, over the page. */
export function Help() {
  const { help } = useStore();
  const dialog = useRef<HTMLDialogElement>(null);
  const open = help.value;
  useEffect(() => {
    if (open) dialog.current?.showModal();
    else dialog.current?.close();
  }, [open]);
  return (
    <dialog
      ref={dialog}
      class="help"
      aria-labelledby="help-title"
      onClose={() => (help.value = false)}
      onClick={(event) => {
        if (event.target === dialog.current) help.value = false; // beside the list
      }}
    >
      <div class="help-inside">
        <h2 id="help-title">Keys</h2>
        <dl>
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
            <dt>arrows, + −</dt>
            <dd>in the points: turn, come nearer, go</dd>
          </div>
        </dl>
        <form method="dialog">
          <button type="submit">Close</button>
        </form>
      </div>
    </dialog>
  );
}
