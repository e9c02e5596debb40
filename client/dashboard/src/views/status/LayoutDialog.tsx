import { useSignal } from "@preact/signals";
import { LAYOUTS } from "../../store/layout";
import { LONGEST_NAME } from "../../store/layouts";
import { useStore } from "../../store/store";
import { Form, TextField } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import "./LayoutDialog.css";

/** Saves the present layout under a name, and removes saved ones. */
export function LayoutDialog({ onDone }: Done) {
  const { layouts } = useStore();
  const text = useSignal("");
  const name = text.value.trim();
  const taken = name in LAYOUTS;
  const names = Object.keys(layouts.named.value);
  return (
    <Form
      class="control column"
      onSubmit={() => {
        layouts.save(name);
        onDone();
      }}
    >
      <TextField label="Name of the present layout" name="layout" maxLength={LONGEST_NAME} aria-invalid={taken} text={text} />
      <p class={taken ? "refusal" : "quiet"} role="status">
        {taken
          ? `${name} is a layout of the page's own: choose another name.`
          : "It is kept in this browser; a copied link shows it to others."}
      </p>
      {names.length > 0 && (
        <ul class="saved-layouts column" aria-label="Saved layouts">
          {names.map((each) => (
            <li key={each} class="row">
              {each}
              <button type="button" aria-label={`Remove ${each}`} onClick={() => layouts.remove(each)}>
                Remove
              </button>
            </li>
          ))}
        </ul>
      )}
      <div class="dialog-actions">
        <span class="spring" />
        <button type="button" onClick={onDone}>
          Close
        </button>
        <button type="submit" class="primary" disabled={name === "" || taken}>
          Save
        </button>
      </div>
    </Form>
  );
}
