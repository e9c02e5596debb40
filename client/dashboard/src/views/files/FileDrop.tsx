import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import { chooseFile, openFile } from "./openFile";
import "./FileDrop.css";

const carriesFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes("Files") ?? false;

/** Opens the files that are dropped anywhere on the page, and says so while they are held over it. */
export function FileDrop() {
  const store = useStore();
  const over = useSignal(false);
  useEffect(() => {
    const onOver = (event: DragEvent): void => {
      if (!carriesFiles(event)) return; // a panel that is moved
      event.preventDefault();
      over.value = true;
    };
    const onLeave = (event: DragEvent): void => {
      if (event.relatedTarget === null) over.value = false;
    };
    const onDrop = (event: DragEvent): void => {
      if (!carriesFiles(event)) return;
      event.preventDefault(); // the browser would leave the page for the file
      over.value = false;
      for (const file of event.dataTransfer?.files ?? []) void openFile(store, file);
    };
    const end = new AbortController();
    const { signal } = end;
    window.addEventListener("dragover", onOver, { signal });
    window.addEventListener("dragleave", onLeave, { signal });
    window.addEventListener("drop", onDrop, { signal });
    return () => end.abort();
  }, [store, over]);
  const sending = store.recordings.sending.value;
  return (
    <>
      {over.value && (
        <div class="file-drop" aria-hidden="true">
          <p>A scene (.toml) to put the camera before, a recording (.h5) to show, a calibration (.npz) to take in</p>
        </div>
      )}
      {sending !== null && (
        <div class="file-sent" role="status">
          <span>{sending.share < 1 ? `Sending ${sending.name}` : `The service reads ${sending.name}`}</span>
          <progress value={sending.share} aria-label="Sent" />
          <Button onClick={sending.cancel}>Cancel</Button>
        </div>
      )}
    </>
  );
}

/** Opens a file of one kind from the disk. */
export function OpenButton({ kind, title }: { readonly kind: string; readonly title: string }) {
  const store = useStore();
  return (
    <Button title={title} onClick={() => chooseFile(store, kind)}>
      Open…
    </Button>
  );
}
