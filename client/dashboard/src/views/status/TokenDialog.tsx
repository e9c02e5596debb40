import { useSignal } from "@preact/signals";

import { useStore } from "../../store/store";
import { Button, Form, TextField } from "../../ui/controls";
import type { Done } from "../../ui/Dialog";
import { tokenWords } from "./words";

/** Asks for the token that the service lets people in with. */
export function TokenDialog({ onDone }: Done) {
  const { api, caller } = useStore();
  const { credentials } = api;
  const text = useSignal("");
  const known = credentials.token.value !== null;
  const recognised = caller.document.value;
  return (
    <Form
      class="control column"
      onSubmit={() => {
        credentials.use(text.peek());
        onDone();
      }}
    >
      <p class={known && credentials.refused.value !== null ? "refusal" : ""} data-field="token-words">
        {tokenWords(credentials)}
      </p>
      <TextField label="Token" type="password" name="token" spellcheck={false} text={text} />
      {known && recognised !== null && (
        <p data-field="caller">
          The service knows this page as <strong>{recognised.name}</strong>, {recognised.role}.
        </p>
      )}
      <p class="quiet">A token is kept until this tab is closed, and sent to this service only.</p>
      <div class="row at-end">
        {known && (
          <Button
            onClick={() => {
              credentials.use(null);
              onDone();
            }}
          >
            Forget the token
          </Button>
        )}
        <span class="grow" />
        <Button onClick={onDone}>Close</Button>
        <Button type="submit" class="primary" disabled={text.value.trim() === ""}>
          Use this token
        </Button>
      </div>
    </Form>
  );
}
