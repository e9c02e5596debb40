import { useSignal } from "@preact/signals";
import { LAYOUTS } from "../../store/layout";
import { LONGEST_NAME } from "../../store/layouts";
import { useStore } from "../../store/store";
import { Button, Form, TextField } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";

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
        <ul class="column spaced" aria-label="Saved layouts">
          {names.map((each) => (
            <li key={each} class="row apart">
              {each}
              <Button aria-label={`Remove ${each}`} onClick={() => layouts.remove(each)}>
                Remove
              </Button>
            </li>
          ))}
        </ul>
      )}
      <div class="row at-end">
        <Button onClick={onDone}>Close</Button>
        <Button type="submit" class="primary" disabled={name === "" || taken}>
          Save
        </Button>
      </div>
    </Form>
  );
}
