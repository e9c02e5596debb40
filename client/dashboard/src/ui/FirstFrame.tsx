import { useComputed } from "@preact/signals";

import { useStore } from "../store/store";

/** In the place of a picture before its first frame: what is waited for. */
export function FirstFrame() {
  const { status, cameraless } = useStore();
  const words = useComputed(() => {
    if (status.connection.value.kind === "refused") return "Pictures are shown to those with a token.";
    if (status.connection.value.kind === "waiting") return "There is no connection to the service.";
    if (cameraless.value) return "No camera is chosen yet.";
    if (status.cameraLoss.value !== null) return "The camera was lost before its first frame.";
    if (status.running.value === false) return "The camera stands still: Start or Single takes a frame.";
    return "Waiting for the first frame";
  });
  return <p class="stage-empty cover">{words}</p>;
}
