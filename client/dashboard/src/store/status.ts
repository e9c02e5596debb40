import { computed, signal } from "@preact/signals";

import type { CameraState, FrameMeta } from "../stream/protocol";

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

/** What the page knows of connection, camera and the flow of frames. Times are of this page's clock. */
export class Status {
  readonly connection = signal<Connection>({ kind: "connecting" });
  /** What the camera is doing; null until it was told. */
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
  readonly unreadable = signal<string | null>(null);
  readonly #drops = signal<ReadonlyMap<number, number>>(new Map());
  /** Frames the service left out for this page, which was slower than the camera. */
  readonly dropped = computed(() => Math.max(0, ...this.#drops.value.values()));
  /** What is on screen is not what the camera sees now. */
  readonly stale = computed(() => this.connection.value.kind !== "open" || this.cameraLoss.value !== null);
  #arrivals: number[] = [];

  /** A new session with the service: it counts anew. */
  sessionOpened(cameraState: CameraState, now_s: number): void {
    this.#drops.value = new Map();
    this.lostImages.value = 0;
    this.unreadable.value = null;
    this.cameraIs(cameraState, now_s);
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
    // Frames that were on their way when the camera went tell nothing of how fast it is; neither does the first,
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

  /** A frame of a recording is on screen: it tells nothing of how fast the camera is. */
  frameReplayed(meta: FrameMeta, encode_s: number): void {
    this.newest.value = meta;
    this.encode_s.value = encode_s;
    this.#forgetRate();
  }

  #forgetRate(): void {
    this.#arrivals = [];
    this.rate_hz.value = null;
    this.latency_s.value = null;
  }
}
