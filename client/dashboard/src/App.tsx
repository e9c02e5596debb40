import { effect } from "@preact/signals";
import { useEffect } from "preact/hooks";

import { useStore } from "./store/store";
import { Help } from "./ui/Help";
import { shortcuts } from "./ui/shortcuts";
import { Arrangement } from "./views/Arrangement";
import { FileDrop } from "./views/files/FileDrop";
import { Palette } from "./views/palette/Palette";
import { ReplayBar } from "./views/replay/ReplayBar";
import { Banner } from "./views/status/Banner";
import { ControlDialog } from "./views/status/ControlDialog";
import { LayoutDialog } from "./views/status/LayoutDialog";
import { StatusBar } from "./views/status/StatusBar";
import { TokenDialog } from "./views/status/TokenDialog";

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
      <Help />
      <Palette />
      <LayoutDialog />
      <ControlDialog />
      <TokenDialog />
      <FileDrop />
    </>
  );
}
