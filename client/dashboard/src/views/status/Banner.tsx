import type { ComponentChildren } from "preact";
import { timeOfDay } from "../../scales/format";
import { lossReason } from "../../store/events";
import { useStore } from "../../store/store";
import { Button } from "../../ui/controls";
import { useNow } from "../../ui/hooks";
import { tokenWords } from "./words";
import "./Banner.css";

/** Says at once what is wrong, and what is being done about it; goes away with it. */
export function Banner({ onRetry }: { onRetry: () => void }) {
  const { api, status, lease, lightOff, cameraless, dialog } = useStore();
  const connection = status.connection.value;
  const off = lightOff.state.value;
  if (off !== null && off.kind !== "sent") {
    const refused = off.kind === "refused";
    return (
      <Alert about="light" word={refused ? "Dismiss" : "Try now"} onClick={() => (refused ? lightOff.withdraw() : lightOff.press())}>
        <strong>The light may be on.</strong> {sentence(off.reason)} {!refused && "This page asks again until it is confirmed off."}
      </Alert>
    );
  }
  if (connection.kind === "refused") {
    return (
      <Alert about="token" word="Enter a token" onClick={() => (dialog.value = "token")}>
        <strong>Not let in.</strong> {tokenWords(api.credentials)}
      </Alert>
    );
  }
  if (connection.kind === "waiting") {
    return (
      <Alert about="connection" word="Try now" onClick={onRetry}>
        <strong>No connection to the service.</strong> {sentence(connection.reason)} <Countdown until_s={connection.retryAt_s} />
      </Alert>
    );
  }
  const loss = status.cameraLoss.value;
  if (loss !== null && cameraless.value && connection.kind === "open") {
    return (
      <Alert about="camera" word="Choose a camera" onClick={() => (dialog.value = "camera")}>
        <strong>No camera</strong> is chosen yet: a device, or a simulation.
      </Alert>
    );
  }
  if (loss !== null && connection.kind === "open") {
    return (
      <Alert about="camera">
        <strong>Camera lost</strong> at {timeOfDay(loss.at_s)}. The service looks for it and goes on by itself; what you see is the last
        frame. {loss.reason !== null && <span class="quiet">Reason: {lossReason(loss.reason)}</span>}
      </Alert>
    );
  }
  if (lease.lost.value !== null) {
    return (
      <Alert mild about="control" word="Dismiss" onClick={() => (lease.lost.value = null)}>
        <strong>No longer in control.</strong> {lease.lost.value}
      </Alert>
    );
  }
  const message = status.failed.value === null ? status.unreadable : status.failed;
  if (message.value === null) return null;
  return (
    <Alert mild about="message" word="Dismiss" onClick={() => (message.value = null)}>
      {message.value}
    </Alert>
  );
}

interface AlertProps {
  readonly about: string;
  /** Nothing is broken. */
  readonly mild?: boolean;
  /** On the button, where something can be done. */
  readonly word?: string;
  readonly onClick?: () => void;
  readonly children: ComponentChildren;
}

function Alert({ about, mild = false, word, onClick, children }: AlertProps) {
  return (
    <div class={mild ? "wrapped banner banner-mild" : "wrapped banner"} role="alert" data-banner={about}>
      <p>{children}</p>
      {word !== undefined && <Button onClick={onClick}>{word}</Button>}
    </div>
  );
}

/** A title, as a sentence. */
function sentence(words: string): string {
  return /[.!?]$/.test(words) ? words : `${words}.`;
}

/** Seconds until the next attempt. */
function Countdown({ until_s }: { until_s: number }) {
  const left_s = Math.max(0, Math.ceil(until_s - useNow(0.25)));
  return <>{left_s > 0 ? `Trying again in ${left_s} s.` : "Trying again."}</>;
}
