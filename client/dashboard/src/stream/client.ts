/** Between the worker and the store: takes what arrives into the store once an animation frame. */
import { effect } from "@preact/signals";

import type { Frame } from "../store/frames";
import type { Store } from "../store/store";
import type { AnimationLoop } from "../ui/animation";
import type { AppliedSequence, Hello, Notice } from "./protocol";
import { coefficientsOf } from "./summary";
import type { Command, FrameReport, Report } from "./worker";

/** What of a Worker is used. */
export interface WorkerPort {
  onmessage: ((event: MessageEvent<Report>) => void) | null;
  postMessage(command: Command, transfer: Transferable[]): void;
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
      const added = wanted.filter((product) => !known.includes(product));
      known = wanted;
      this.#send({ type: "want", products: wanted });
      // A camera that stands still sends nothing: its last frame is asked for.
      if (this.#store.running.peek() === false) for (const product of added) void this.#fetchLatest(product);
    });
    effect(() => {
      if (!this.#store.held.value) this.#loop.wake();
    });
    effect(() => {
      if (this.#store.running.value !== false) return;
      for (const product of this.#store.frames.wanted.peek()) {
        if (this.#store.frames.of(product).peek() === null) void this.#fetchLatest(product);
      }
    });
  }

  retryNow(): void {
    this.#send({ type: "retry" });
  }

  /** Takes the body of a frame message that did not come through the stream. */
  decode(body: ArrayBuffer): void {
    this.#send({ type: "decode", body }, [body]);
  }

  #send(command: Command, transfer: Transferable[] = []): void {
    this.#worker.postMessage(command, transfer);
  }

  async #fetchLatest(product: string): Promise<void> {
    try {
      const body = await this.#store.api.latest(product);
      if (body !== null) this.decode(body);
    } catch {
      // The views say that there is no frame; the connection says why.
    }
  }

  #receive(report: Report): void {
    const { status } = this.#store;
    switch (report.type) {
      case "connecting":
        status.connection.value = { kind: "connecting" };
        break;
      case "open":
        status.connection.value = { kind: "open" };
        void this.#readDocuments();
        break;
      case "waiting":
        status.connectionLost(report.reason, this.#now_s() + report.retry_s);
        break;
      case "camera":
        status.cameraIs(report.state, this.#now_s());
        void this.#readDocuments();
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
        status.cameraLost(this.#now_s(), notice.reason);
        break;
      case "camera-back":
        status.cameraBack();
        void this.#readDocuments();
        break;
      case "sequence-changed":
        this.#takeSequence(notice.sequence);
        break;
    }
  }

  #takeSequence(sequence: AppliedSequence | null): void {
    if (sequence !== null) this.#store.sequence.value = sequence;
  }

  /** What the stream does not tell: the camera's capabilities, and whether it is running. */
  async #readDocuments(): Promise<void> {
    const { api, camera, running } = this.#store;
    try {
      [camera.value, { running: running.value }] = await Promise.all([api.camera(), api.acquisition()]);
    } catch {
      // Asked again at the next change; the stream itself says whether the service is there.
    }
  }

  #draw(): void {
    if (this.#store.held.peek() || this.#pending.size === 0) return;
    let newest = 0;
    for (const report of this.#pending.values()) {
      const { message, streamed } = report;
      this.#store.frames.put(frameOf(report));
      if (!streamed) continue;
      newest = Math.max(newest, message.meta.frame);
      this.#store.status.frameDrawn(message.meta, message.encode_s, this.#now_s());
      this.#store.running.value = true;
    }
    this.#pending.clear();
    if (newest > 0) this.#send({ type: "acknowledge", frame: newest });
  }
}

function frameOf({ message, map, light }: FrameReport): Frame {
  const { product, unit, meta, array } = message;
  const coefficients = product === "coefficients" ? coefficientsOf(message) : null;
  return { product, unit, meta, shape: array.shape, values: array.data, map, light, coefficients };
}
