import { useStore } from "../../store/store";
import { chooseFile } from "./openFile";

/** Opens a file of one kind from the disk. */
export function OpenButton({ kind, title }: { readonly kind: string; readonly title: string }) {
  const store = useStore();
  return (
    <button type="button" title={title} onClick={() => chooseFile(store, kind)}>
      Open…
    </button>
  );
}
