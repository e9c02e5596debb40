import { effect } from "@preact/signals";
import { useEffect } from "preact/hooks";

import { useStore } from "./store/store";
import { SwitchedDialog } from "./ui/Dialog";
import { Help } from "./ui/Help";
import { shortcuts } from "./ui/shortcuts";
import { Arrangement } from "./views/Arrangement";
import { CameraDialog } from "./views/camera/CameraDialog";
import { FileDrop } from "./views/files/FileDrop";
import { later } from "./views/later";
import { Palette } from "./views/palette/Palette";
import { ReplayBar } from "./views/replay/ReplayBar";
import { Banner } from "./views/status/Banner";
import { ControlDialog } from "./views/status/ControlDialog";
import { LayoutDialog } from "./views/status/LayoutDialog";
import { StatusBar } from "./views/status/StatusBar";
import { TokenDialog } from "./views/status/TokenDialog";

const Examples = later(() => import("./views/examples/Examples"));

/** The page: how things stand, what is wrong, and the views. */
export function App({ onRetry }: { onRetry: () => void }) {
  const store = useStore();
  useEffect(() => shortcuts(window, store), [store]);
  useEffect(
    () =>
      effect(() => {
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
      <SwitchedDialog open={store.help} title="Keys" inside={Help} />
      <SwitchedDialog open={store.examples} title="Examples" inside={Examples} />
      <SwitchedDialog open={store.palette} title="All commands" inside={Palette} />
      <SwitchedDialog open={store.asksForLayout} title="Layouts" inside={LayoutDialog} />
      <SwitchedDialog open={store.asksForControl} title="Control" inside={ControlDialog} />
      <SwitchedDialog open={store.asksForCamera} title="Camera" inside={CameraDialog} />
      <SwitchedDialog open={store.asksForToken} title="Authentication required" inside={TokenDialog} />
      <FileDrop />
    </>
  );
}
