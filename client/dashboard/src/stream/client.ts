/** Between the worker and the store: takes what arrives into the store once an animation frame. */
import { effect } from "@preact/signals";

import type { Frame } from "../store/frames";
import type { Store } from "../store/store";
import type { AnimationLoop } from "../ui/animation";
import type { AppliedSequence, CameraDocument, Hello, Notice } from "./protocol";
import { coefficientsOf, type FrameReport } from "./summary";
import type { Command, Report } from "./worker";

/** What of a Worker is used. */
export interface WorkerPort {
  onmessage: ((event: MessageEvent<Report>) => void) | null;
  postMessage(command: Command): void;
}

/** The page's clock in s of unix time. */
type Clock = () => number;

export class StreamClient {
  readonly #store: Store;
  readonly #worker: WorkerPort;
  readonly #loop: AnimationLoop;
  readonly #now_s: Clock;
  /** Newest frame a product that is not drawn yet: what comes faster than the display replaces it. */
  readonly #pending = new Map<string, FrameReport>();
  #asking = false;

  constructor(store: Store, worker: WorkerPort, loop: AnimationLoop, now_s: Clock = () => Date.now() / 1000) {
    this.#store = store;
    this.#worker = worker;
    this.#loop = loop;
    this.#now_s = now_s;
    worker.onmessage = ({ data }) => {
      this.#receive(data);
    };
    loop.add(() => {
      this.#draw();
      return false;
    });
  }

  /** Connects, and keeps streaming what the store's views want. */
  open(url: string): void {
    this.#send({ type: "open", url, products: this.#store.frames.wanted.peek() });
    let known = this.#store.frames.wanted.peek();
    effect(() => {
      const wanted = this.#store.frames.wanted.value;
      if (wanted === known) return;
      known = wanted;
      this.#send({ type: "want", products: wanted });
    });
    effect(() => {
      if (!this.#store.held.value) this.#loop.wake();
    });
  }

  retryNow(): void {
    this.#send({ type: "retry" });
  }

  #send(command: Command): void {
    this.#worker.postMessage(command);
  }

  #receive(report: Report): void {
    const { status } = this.#store;
    switch (report.type) {
      case "connecting":
        status.connection.value = { kind: "connecting" };
        break;
      case "open":
        status.connection.value = { kind: "open" };
        void this.#readCamera();
        break;
      case "waiting":
        status.connectionLost(report.reason, this.#now_s() + report.retry_s);
        break;
      case "camera":
        this.#takeCamera(report.document);
        break;
      case "unreadable":
        status.unreadable.value = report.reason;
        break;
      case "frame":
        this.#pending.set(report.message.product, report);
        this.#loop.wake();
        break;
      case "message":
        if (report.message.type === "hello") this.#greet(report.message);
        else if (report.message.type === "notice") this.#notice(report.message);
        else if (report.message.type === "error") {
          status.unreadable.value = report.message.problem.detail ?? report.message.problem.title ?? null;
        }
        break;
    }
  }

  #greet(hello: Hello): void {
    this.#store.status.sessionOpened(hello.camera.state, this.#now_s());
    this.#takeSequence(hello.sequence);
  }

  #notice(notice: Notice): void {
    const { status } = this.#store;
    switch (notice.kind) {
      case "dropped":
        status.dropNotice(notice.channel, notice.total);
        break;
      case "lost-images":
        status.lostImages.value += notice.count;
        break;
      case "camera-lost":
        status.cameraIs("lost", this.#now_s(), notice.reason);
        break;
      case "camera-back":
        status.cameraIs("streaming", this.#now_s());
        void this.#readCamera();
        break;
      case "sequence-changed":
        this.#takeSequence(notice.sequence);
        break;
    }
  }

  #takeSequence(sequence: AppliedSequence | null): void {
    if (sequence !== null) this.#store.sequence.value = sequence;
  }

  /** What the stream does not tell: what the camera is and can do. */
  async #readCamera(): Promise<void> {
    if (this.#asking) return;
    this.#asking = true;
    try {
      this.#takeCamera(await this.#store.api.camera());
    } catch {
      // Asked again when there is a connection again; the stream itself says that there is none.
    } finally {
      this.#asking = false;
    }
  }

  #takeCamera(document: CameraDocument): void {
    this.#store.camera.value = document;
    this.#store.status.cameraIs(document.state, this.#now_s(), document.reason);
  }

  #draw(): void {
    if (this.#store.held.peek() || this.#pending.size === 0) return;
    let newest = 0;
    for (const report of this.#pending.values()) {
      this.#store.frames.put(frameOf(report));
      const { meta } = report.message;
      newest = Math.max(newest, meta.frame);
      this.#store.status.frameDrawn(meta, this.#now_s());
    }
    this.#pending.clear();
    // Somebody else may have started the camera; or this frame was on its way when it stopped. It knows.
    if (this.#store.status.cameraState.peek() !== "streaming") void this.#readCamera();
    this.#send({ type: "acknowledge", frame: newest });
  }
}

/** A frame as views see it. */
export function frameOf({ message, map, light }: FrameReport): Frame {
  const { product, unit, meta, array } = message;
  const coefficients = product === "coefficients" ? coefficientsOf(message) : null;
  return { product, unit, meta, shape: array.shape, values: array.data, map, light, coefficients };
}
