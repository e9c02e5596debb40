import { useComputed, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { timeOfDay } from "../../scales/format";
import { lossReason } from "../../store/events";
import { useStore } from "../../store/store";
import { tokenWords } from "./words";
import "./Banner.css";

/** Says at once what is wrong, and what is being done about it; goes away with it. */
export function Banner({ onRetry }: { onRetry: () => void }) {
  const { api, status, lease, lightOff, asksForToken } = useStore();
  const connection = status.connection.value;
  const off = lightOff.state.value;
  if (off !== null && off.kind !== "sent") {
    return (
      <div class="banner" role="alert" data-banner="light">
        <p>
          <strong>The light may be on.</strong> {sentence(off.reason)}{" "}
          {off.kind === "unconfirmed" && "This page asks again until it is confirmed off."}
        </p>
        <button type="button" onClick={() => (off.kind === "refused" ? lightOff.withdraw() : lightOff.press())}>
          {off.kind === "refused" ? "Dismiss" : "Try now"}
        </button>
      </div>
    );
  }
  if (connection.kind === "refused") {
    return (
      <div class="banner" role="alert" data-banner="token">
        <p>
          <strong>Not let in.</strong> {tokenWords(api.credentials)}
        </p>
        <button type="button" onClick={() => (asksForToken.value = true)}>
          Enter a token
        </button>
      </div>
    );
  }
  if (connection.kind === "waiting") {
    return (
      <div class="banner" role="alert" data-banner="connection">
        <p>
          <strong>No connection to the service.</strong> {sentence(connection.reason)} <Countdown until_s={connection.retryAt_s} />
        </p>
        <button type="button" onClick={onRetry}>
          Try now
        </button>
      </div>
    );
  }
  const loss = status.cameraLoss.value;
  if (loss !== null && connection.kind === "open") {
    return (
      <div class="banner" role="alert" data-banner="camera">
        <p>
          <strong>Camera lost</strong> at {timeOfDay(loss.at_s)}. The service looks for it and goes on by itself; what you see is the last
          frame. {loss.reason !== null && <span class="quiet">Reason: {lossReason(loss.reason)}</span>}
        </p>
      </div>
    );
  }
  if (lease.lost.value !== null) {
    return (
      <div class="banner banner-mild" role="alert" data-banner="control">
        <p>
          <strong>No longer in control.</strong> {lease.lost.value}
        </p>
        <button type="button" onClick={() => (lease.lost.value = null)}>
          Dismiss
        </button>
      </div>
    );
  }
  return <Unreadable />;
}

/** A title, as a sentence. */
function sentence(words: string): string {
  return /[.!?]$/.test(words) ? words : `${words}.`;
}

function Unreadable() {
  const { status } = useStore();
  if (status.unreadable.value === null) return null;
  return (
    <div class="banner banner-mild" role="alert" data-banner="message">
      <p>{status.unreadable.value}</p>
      <button type="button" onClick={() => (status.unreadable.value = null)}>
        Dismiss
      </button>
    </div>
  );
}

/** Seconds until the next attempt. */
function Countdown({ until_s }: { until_s: number }) {
  const now_s = useSignal(Date.now() / 1000);
  useEffect(() => {
    const timer = setInterval(() => (now_s.value = Date.now() / 1000), 250);
    return () => clearInterval(timer);
  }, [now_s]);
  const left = useComputed(() => Math.max(0, Math.ceil(until_s - now_s.value)));
  return <>{left.value > 0 ? `Trying again in ${left.value} s.` : "Trying again."}</>;
}
