import { computed, signal } from "@preact/signals";

import type { Decision } from "../stream/demand";
import type { FrameMeta } from "../stream/documents";
import type { CameraState } from "../stream/protocol";

/** How this page stands with the service. */
export type Connection =
  | { readonly kind: "connecting" }
  | { readonly kind: "open" }
  /** The service lets this page in only with a token that it knows. */
  | { readonly kind: "refused" }
  | { readonly kind: "waiting"; readonly retryAt_s: number; readonly reason: string };

/** Frames whose arrival the rate is taken over, and how long they count; the last few count however old. */
const RATE_FRAMES = 64;
const RATE_FEWEST = 3;
const RATE_WINDOW_S = 3;

/** How frames come; null where it is not known. */
export interface Flow {
  readonly rate_hz: number | null;
  readonly latency_s: number | null;
  /** When the last one was drawn, by the page's clock. */
  readonly last_s: number | null;
}

/** Share of the sequence's rate below which frames come too seldom, and when they come too late to steer by. */
const LEAST_SHARE = 0.3;
const LATE_S = 1.5;
/** Frames of another clock may seem to be older than this. */
export const CREDIBLE_LATENCY_S = 30;
/** How long no frame may come, besides the time of some. */
const SILENCE_S = 3;

/** What is wrong with the flow of frames of a sequence of `expected_hz`, in words; null where nothing is. */
export function flowTrouble({ rate_hz, latency_s, last_s }: Flow, expected_hz: number | null, now_s: number): string | null {
  const period_s = expected_hz === null ? 0 : 1 / expected_hz;
  const silent_s = last_s === null ? 0 : now_s - last_s;
  if (silent_s > SILENCE_S + 3 * period_s) return `No frame has come for ${Math.round(silent_s)} s.`;
  if (rate_hz !== null && expected_hz !== null && rate_hz < LEAST_SHARE * expected_hz) {
    return `${rate_hz.toFixed(1)} of ${expected_hz.toFixed(1)} frames a second are shown: the service, the network or this browser is too slow.`;
  }
  if (latency_s !== null && latency_s > LATE_S && latency_s < CREDIBLE_LATENCY_S)
    return `Frames are shown ${latency_s.toFixed(1)} s after they were captured.`;
  return null;
}

/** What the page knows of connection, camera and the flow of frames. Times are of this page's clock. */
export class Status {
  readonly connection = signal<Connection>({ kind: "connecting" });
  /** What the camera is doing; null until that is known. */
  readonly cameraState = signal<CameraState | null>(null);
  /** Whether the camera is taking frames; null while that is not known. */
  readonly running = computed(() => {
    const state = this.cameraState.value;
    return state === null || state === "lost" ? null : state !== "stopped";
  });
  /** When the camera was lost, in s of unix time, and why if that is known; null while it is there. */
  readonly cameraLoss = signal<{ readonly at_s: number; readonly reason: string | null } | null>(null);
  readonly newest = signal<FrameMeta | null>(null);
  readonly rate_hz = signal<number | null>(null);
  readonly latency_s = signal<number | null>(null);
  /** Time the service took to bring the frame on screen, with all its products, into the form it was sent in. */
  readonly encode_s = signal<number | null>(null);
  readonly lostImages = signal(0);
  /** What this session of the service would not do or sent unread; a new one starts without. */
  readonly unreadable = signal<string | null>(null);
  /** What the page itself could not do; it stays until it was read. */
  readonly failed = signal<string | null>(null);
  readonly #drops = signal<ReadonlyMap<number, number>>(new Map());
  /** Those of subscriptions before the present one. */
  readonly #droppedBefore = signal(0);
  /** Frames the service left out for this page, which was slower than the camera. */
  readonly dropped = computed(() => this.#droppedBefore.value + Math.max(0, ...this.#drops.value.values()));
  /** Where less than everything is asked for, as link or page take no more: what, and why. */
  readonly demanded = signal<Decision | null>(null);
  /** What is on screen is not what the camera sees now. */
  readonly stale = computed(() => this.connection.value.kind !== "open" || this.cameraLoss.value !== null);
  /** How frames come, as far as it is known. */
  readonly flow = computed((): Flow => ({ rate_hz: this.rate_hz.value, latency_s: this.latency_s.value, last_s: this.#last_s.value }));
  readonly #last_s = signal<number | null>(null);
  #arrivals: number[] = [];

  /** The time at the service, at a time of this page: the same, unless frames seem to come from the future or from long ago. */
  serviceTime_s(now_s: number): number {
    const latency_s = this.latency_s.peek() ?? 0;
    return latency_s >= 0 && latency_s < CREDIBLE_LATENCY_S ? now_s : now_s - latency_s;
  }

  /** A new session with the service: it counts anew. */
  sessionOpened(cameraState: CameraState, now_s: number): void {
    this.#drops.value = new Map();
    this.#droppedBefore.value = 0;
    this.lostImages.value = 0;
    this.unreadable.value = null;
    this.cameraIs(cameraState, now_s);
  }

  /** Something else is asked for in the same session: the service counts what it leaves out anew. */
  subscribedAnew(): void {
    this.#droppedBefore.value = this.dropped.peek();
    this.#drops.value = new Map();
  }

  cameraIs(state: CameraState, now_s: number, reason: string | null = null): void {
    this.cameraState.value = state;
    const known = this.cameraLoss.peek();
    if (state === "lost") this.cameraLoss.value = { at_s: known?.at_s ?? now_s, reason: reason ?? known?.reason ?? null };
    else this.cameraLoss.value = null;
    if (state === "lost" || state === "stopped") this.#forgetRate();
  }

  connectionLost(reason: string, retryAt_s: number): void {
    this.connection.value = { kind: "waiting", reason, retryAt_s };
    this.#forgetRate();
  }

  dropNotice(channel: number, total: number): void {
    this.#drops.value = new Map(this.#drops.peek()).set(channel, total);
  }

  /** A frame was drawn at `now_s`; several products of one frame count once. */
  frameDrawn(meta: FrameMeta, now_s: number): void {
    const shown = this.newest.peek();
    if (shown?.frame === meta.frame) return;
    this.newest.value = meta;
    this.#last_s.value = now_s;
    // Frames that were on their way when the camera went say nothing of how fast it is; neither does the first,
    // which may be old.
    if (this.cameraLoss.peek() !== null || shown === null) return;
    const latency_s = now_s - meta.host_time_s;
    const known = this.latency_s.peek();
    this.latency_s.value = known === null ? latency_s : known + 0.2 * (latency_s - known);
    this.#arrivals.push(now_s);
    const recent = this.#arrivals.filter((at_s) => now_s - at_s < RATE_WINDOW_S).length;
    this.#arrivals = this.#arrivals.slice(-Math.min(RATE_FRAMES, Math.max(RATE_FEWEST, recent)));
    const span_s = now_s - this.#arrivals[0];
    this.rate_hz.value = span_s > 0 ? (this.#arrivals.length - 1) / span_s : null;
  }

  /** A frame of a recording is on screen: it says nothing of how fast the camera is. */
  frameReplayed(meta: FrameMeta, encode_s: number): void {
    this.newest.value = meta;
    this.encode_s.value = encode_s;
    this.#forgetRate();
  }

  #forgetRate(): void {
    this.#arrivals = [];
    this.#last_s.value = null;
    this.rate_hz.value = null;
    this.latency_s.value = null;
  }
}
