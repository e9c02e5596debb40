import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import { chooseFile } from "./openFile";

/** Opens a file of one kind from the disk. */
export function OpenButton({ kind, title }: { readonly kind: string; readonly title: string }) {
  const store = useStore();
  return (
    <Button title={title} onClick={() => chooseFile(store, kind)}>
      Open…
    </Button>
  );
}
