import { effect } from "@preact/signals";
import type { ComponentType } from "preact";
import { useEffect } from "preact/hooks";

import { type DialogName, useStore } from "./store/store";
import { Dialog, type Done } from "./ui/Dialog";
import { shortcuts } from "./ui/shortcuts";
import { Arrangement } from "./views/Arrangement";
import { FileDrop } from "./views/files/FileDrop";
import { later } from "./views/later";
import { Palette } from "./views/palette/Palette";
import { ReplayBar } from "./views/replay/ReplayBar";
import { Banner } from "./views/status/Banner";
import { LayoutDialog } from "./views/status/LayoutDialog";
import { StatusBar } from "./views/status/StatusBar";
import { TokenDialog } from "./views/status/TokenDialog";

const Examples = later(() => import("./views/examples/Examples"));
const CameraDialog = later<Done>(() => import("./views/camera/CameraDialog"));
const ControlDialog = later<Done>(() => import("./views/status/ControlDialog"));
const Help = later<Done>(() => import("./views/palette/Help"));
const Tour = later<Done>(() => import("./views/examples/Tour"));

const DIALOGS: readonly (readonly [name: DialogName, title: string, inside: ComponentType<Done>])[] = [
  ["help", "Help and keys", Help],
  ["examples", "Examples", Examples],
  ["palette", "All commands", Palette],
  ["layout", "Layouts", LayoutDialog],
  ["control", "Control", ControlDialog],
  ["camera", "Camera", CameraDialog],
  ["token", "Authentication required", TokenDialog],
];

/** The page: how things stand, what is wrong, and the views. */
export function App({ onRetry }: { onRetry: () => void }) {
  const store = useStore();
  const close = (): void => void (store.dialog.value = null);
  useEffect(() => shortcuts(window, store), [store]);
  useEffect(
    () =>
      effect(() => {
        document.documentElement.dataset.kiosk = String(store.kiosk.value);
        document.documentElement.dataset.stale = String(store.status.stale.value && !store.replay.active.value);
      }),
    [store],
  );
  return (
    <>
      <StatusBar />
      <Banner onRetry={onRetry} />
      <Arrangement />
      <ReplayBar />
      {DIALOGS.map(([name, title, Inside]) => (
        <Dialog key={name} open={store.dialog.value === name} title={title} onClose={close}>
          <Inside onDone={close} />
        </Dialog>
      ))}
      {store.dialog.value === "tour" && <Tour onDone={close} />}
      <FileDrop />
    </>
  );
}
