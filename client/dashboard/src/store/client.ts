/** Between the worker and the store: takes what arrives into the store once an animation frame. */
import { effect, untracked } from "@preact/signals";
import type { AppliedDocument, CameraDocument } from "../stream/documents";
import { Fluency } from "../stream/fluency";
import type { ErrorMessage, Hello, Notice, Problem } from "../stream/protocol";
import type { FrameReport } from "../stream/summary";
import type { Command, Report } from "../stream/worker";
import type { AnimationLoop } from "./animation";
import { kindOf, LIVE, liveFrame, RequestError, refusalIn } from "./api";
import { inWords, lossWords, sequenceKey } from "./events";
import { frameOf, isWhole } from "./frames";
import { MAP_PRODUCTS, mapOf } from "./mapCatalogue";
import type { Store } from "./store";

/** What of a Worker is used. */
export interface WorkerPort {
  onmessage: ((event: MessageEvent<Report>) => void) | null;
  postMessage(command: Command): void;
}

/** The page's clock in s of unix time. */
type Clock = () => number;

export class StreamClient {
  /** Newest frame a product that is not drawn yet: what comes faster than the display replaces it. */
  readonly #pending = new Map<string, FrameReport>();
  /** Frames of recordings that are asked for, by their tickets. */
  readonly #errands = new Map<number, Errand>();
  readonly #brought: (() => void)[] = [];
  #tickets = 0;
  #filling: ReturnType<typeof setTimeout> | undefined;
  #asking = false;
  #looking: ReturnType<typeof setTimeout> | undefined;
  #session = "";
  readonly #fluency = new Fluency();
  /** The worker knows that light stands or is measured. */
  #rests = false;

  constructor(
    private readonly store: Store,
    private readonly worker: WorkerPort,
    private readonly loop: AnimationLoop,
    private readonly now_s: Clock = () => Date.now() / 1000,
  ) {
    worker.onmessage = ({ data }) => (this.#received[data.type] as (report: Report) => void)(data);
    loop.add(() => {
      this.#draw();
      for (const take of this.#brought.splice(0)) take();
      return this.#count();
    });
    store.replay.loader = store.rangeErrors.loader = store.comparison.loader = (path, products) => this.#bring(path, products);
  }

  /** Connects, and keeps streaming what the store's views need. */
  open(url: string): void {
    const { token } = this.store.api.credentials;
    let known = this.store.frames.wanted.peek();
    let shown = token.peek();
    this.#send({ type: "open", url, products: known, token: shown });
    effect(() => {
      if (token.value === shown) return;
      shown = token.value;
      this.#send({ type: "authenticate", token: shown });
    });
    effect(() => {
      const wanted = this.store.frames.wanted.value;
      if (wanted === known) return;
      known = wanted;
      this.#send({ type: "want", value: wanted });
    });
    effect(() => this.#send({ type: "adapt", value: this.store.adapts.value }));
    effect(() => {
      const sight = this.store.sight.value;
      clearTimeout(this.#looking);
      this.#looking = setTimeout(() => this.#send({ type: "look", value: sight }), 1000 * SETTLED_S);
    });
    effect(() => {
      if (this.store.held.value) void untracked(() => this.#complete());
      this.loop.wake();
    });
    let replayed = false;
    effect(() => {
      const active = this.store.replay.active.value;
      // Frames that waited meanwhile are old: ask for new ones.
      if (replayed && !active) this.#send({ type: "want", value: known });
      replayed = active;
      this.loop.wake();
    });
  }

  /** The page was hidden, or is seen again. */
  hid(): void {
    this.#fluency.restart();
  }

  retryNow(): void {
    this.#send({ type: "retry" });
  }

  #send(command: Command): void {
    this.worker.postMessage(command);
  }

  readonly #received: { readonly [Type in Report["type"]]: (report: Extract<Report, { type: Type }>) => void } = {
    connecting: () => (this.store.status.connection.value = { kind: "connecting" }),
    open: () => (this.store.status.connection.value = { kind: "open" }),
    refused: () => {
      this.store.status.connection.value = { kind: "refused" };
      this.store.caller.forget();
      this.store.dialog.value = "token";
    },
    waiting: ({ reason, retry_s }) => this.store.status.connectionLost(reason, this.now_s() + retry_s),
    camera: ({ document }) => this.#takeCamera(document),
    demand: (report) => {
      this.store.status.demanded.value = report.carried_bytes_s === null && report.pictures_hz === null ? null : report;
      this.#fluency.restart();
    },
    unreadable: ({ reason }) => (this.store.status.unreadable.value = reason),
    frame: (report) => {
      this.#pending.set(report.message.product, report);
      this.loop.wake();
    },
    brought: ({ ticket, reports, problem }) => this.#deliver(ticket, reports, problem),
    message: ({ message }) => {
      if (message.type === "hello") this.#greet(message);
      else if (message.type === "notice") this.#notice(message);
      else if (message.type === "error") this.#complain(message);
    },
  };

  #greet(hello: Hello): void {
    const { status } = this.store;
    this.#takeSequence(hello.sequence);
    if (hello.session === this.#session) {
      status.subscribedAnew();
      status.cameraIs(hello.camera.state, this.now_s());
    } else {
      this.#session = hello.session;
      status.sessionOpened(hello.camera.state, this.now_s());
      this.store.simulation.world.value = null; // of what may be another camera by now
      void this.#readCamera();
      void this.learnAbsent();
      void this.store.caller.look();
      void this.store.lease.look();
      void this.store.recordings.refresh();
    }
    clearTimeout(this.#filling);
    const soon = hello.camera.state === "streaming" && (hello.sequence?.capture_s ?? 0) < SOON_S;
    this.#filling = setTimeout(() => void this.#fillIn(), soon ? 1000 * SOON_S : 0);
  }

  /** A camera that stands still, or takes seconds for a frame, is shown by the newest frame there is. */
  async #fillIn(): Promise<void> {
    const { api, frames, replay, status } = this.store;
    const missing = (): string[] => frames.wanted.peek().filter((product) => frames.of(product).peek()?.origin !== LIVE);
    if (replay.active.peek() || missing().length === 0) return;
    try {
      if ((await api.newestFrame()) === null) return;
      const reports = await this.#bring(LIVE, missing());
      if (replay.active.peek()) return;
      for (const report of reports) {
        if (!missing().includes(report.message.product)) continue; // the stream was quicker
        frames.put(frameOf(report));
        status.frameDrawn(report.message.meta, this.now_s());
      }
    } catch (error) {
      refusalIn(error); // the stream says what is wrong
    }
  }

  /** Fetches all pixels of frames that are held and were sent in part. */
  async #complete(): Promise<void> {
    const { frames, held } = this.store;
    for (const product of frames.wanted.peek()) {
      const shown = frames.of(product).peek();
      if (shown === null || shown.origin !== LIVE || isWhole(shown.meta)) continue;
      try {
        const [report] = await this.#bring(liveFrame(shown.meta.frame), [product]);
        if (held.peek() && frames.of(product).peek() === shown) frames.put(frameOf(report));
      } catch (error) {
        refusalIn(error); // the service has it no more: it stays as it is
      }
    }
  }

  #complain({ problem }: ErrorMessage): void {
    // A refused user is asked for a token; an error beside that would say nothing more.
    if (TOKEN_PROBLEMS.includes(kindOf(problem))) this.store.api.credentials.refused.value = problem;
    else if (kindOf(problem) === UNKNOWN_PRODUCT) void this.learnAbsent();
    else this.store.status.unreadable.value = problem.detail ?? problem.title ?? null;
  }

  #notice(notice: Notice): void {
    const { events, sequence } = this.store;
    const shown = inWords(notice);
    // A calibration sets the sequence anew although it stays as it is.
    const unchanged = notice.kind === "sequence-changed" && sameSequence(notice.sequence, sequence.peek());
    const key = notice.kind === "sequence-changed" ? { key: sequenceKey(notice.sequence) } : {};
    if (shown !== null && !unchanged) events.tell(shown.words, shown.tone, key);
    (this.#told[notice.kind] as ((notice: Notice) => void) | undefined)?.(notice);
  }

  /** What the notices of the service change on the page, besides being told. */
  readonly #told: { readonly [Kind in Notice["kind"]]?: (notice: Extract<Notice, { kind: Kind }>) => void } = {
    dropped: ({ channel, total }) => this.store.status.dropNotice(channel, total),
    "lost-images": ({ count }) => {
      this.store.status.lostImages.value += count;
      this.store.events.tally("lost-images", count, lossWords, "plain");
    },
    "camera-lost": ({ reason }) => {
      this.store.status.cameraIs("lost", this.now_s(), reason);
      void this.store.simulation.keepUp();
    },
    "light-arming": () => this.store.status.cameraIs("arming", this.now_s()),
    "light-off": () => this.store.status.cameraIs("stopped", this.now_s()),
    "camera-back": () => {
      this.store.status.cameraIs("streaming", this.now_s());
      void this.#readCamera();
      void this.store.simulation.keepUp();
    },
    "sequence-changed": ({ sequence }) => {
      this.#takeSequence(sequence);
      void this.store.caller.look(); // kernels may have to be prepared for it
      void this.store.calibrations.keepUp(); // which are good for some sequences only
    },
    "lease-changed": () => void this.store.lease.look(),
    "reconstruction-changed": () => {
      this.store.replay.recompute();
      this.store.comparison.recompute();
      void this.store.caller.look();
      void this.store.reconstruction.keepUp();
    },
    "calibration-changed": () => void this.store.calibrations.keepUp(),
    "simulation-changed": () => {
      const { frames, status, accuracy, rangeErrors, details, simulation } = this.store;
      frames.sceneSince_s = status.serviceTime_s(this.now_s());
      accuracy.sceneChanged();
      rangeErrors.sceneChanged();
      details.forget();
      void simulation.keepUp();
    },
    "recording-started": () => void this.store.recordings.refresh(),
    "recording-stopped": () => void this.store.recordings.refresh(),
  };

  #takeSequence(sequence: AppliedDocument | null): void {
    if (sequence !== null) this.store.sequence.value = sequence;
  }

  /** What the stream does not say: what the camera is and can do. */
  async #readCamera(): Promise<void> {
    if (this.#asking) return;
    this.#asking = true;
    try {
      this.#takeCamera(await this.store.api.ask("GET /camera"));
    } catch {
      // Asked again when there is a connection again; the stream itself says that there is none.
    } finally {
      this.#asking = false;
    }
  }

  /** Reads which products the camera does not have: before the first subscription, which asks for no other. */
  async learnAbsent(): Promise<void> {
    const { api, frames, accuracy } = this.store;
    try {
      const { absent_products, estimators, products } = await api.ask("GET /info");
      const others = products.filter(({ stated }) => stated !== null).map(({ name, unit, summary }) => mapOf(name, unit, summary));
      if (others.length > 0) frames.maps.value = [...MAP_PRODUCTS, ...others];
      accuracy.others.value = estimators.flatMap(({ name, label, unusable }) =>
        unusable === null ? [{ name, label: label ?? name }] : [],
      );
      const absent = Object.fromEntries(absent_products.map(({ name, reason }) => [name, reason]));
      if (JSON.stringify(absent) !== JSON.stringify(frames.absent.peek())) frames.absent.value = absent;
    } catch (error) {
      refusalIn(error); // the stream says what is wrong
    }
  }

  #takeCamera(document: CameraDocument): void {
    this.store.camera.value = document;
    if (document.simulated && this.store.simulation.world.peek() === null) void this.store.simulation.follow();
    this.store.status.cameraIs(document.state, this.now_s(), document.reason);
  }

  #draw(): void {
    if (this.store.held.peek() || this.store.replay.active.peek() || this.#pending.size === 0) return;
    let newest = 0;
    let encode_s = 0;
    for (const report of this.#pending.values()) {
      this.store.frames.put(frameOf(report));
      const { meta } = report.message;
      newest = Math.max(newest, meta.frame);
      encode_s += report.message.encode_s;
      this.store.status.frameDrawn(meta, this.now_s());
    }
    this.store.status.encode_s.value = encode_s;
    this.#pending.clear();
    // Another client may have started the camera; or this frame was on its way when it stopped: read the state.
    if (this.store.status.cameraState.peek() !== "streaming") void this.#readCamera();
    this.#send({ type: "acknowledge", value: newest });
  }

  /** Counts how fluently the light of the stream moves; true while each refresh of the screen is to be counted. */
  #count(): boolean {
    const { player, frames, held, replay, measures } = this.store;
    const measured = measures.pins.peek().length > 0 || measures.region.peek() !== null;
    const rests = !(player.playing.peek() || player.scrubbed.peek()) || measured || held.peek() || replay.active.peek();
    if (rests !== this.#rests) this.#send({ type: "rest", value: rests });
    this.#rests = rests;
    if (rests || frames.of("coefficients").peek() === null) {
      this.#fluency.restart();
      return false;
    }
    const pictures_hz = this.#fluency.refreshed(this.now_s());
    if (pictures_hz !== null) this.#send({ type: "moved", value: pictures_hz });
    return true;
  }

  /** Has the worker bring products of a frame; they come before a refresh of the display, like all frames. */
  #bring(path: string, products: readonly string[]): Promise<readonly FrameReport[]> {
    const ticket = ++this.#tickets;
    return new Promise((resolve, reject) => {
      this.#errands.set(ticket, { resolve, reject });
      this.#send({ type: "bring", ticket, path, products });
    });
  }

  #deliver(ticket: number, reports: readonly FrameReport[], problem: Problem | null): void {
    const errand = this.#errands.get(ticket);
    this.#errands.delete(ticket);
    if (errand === undefined) return;
    if (problem !== null && reports.length === 0) {
      errand.reject(new RequestError(problem));
      return;
    }
    this.#brought.push(() => errand.resolve(reports));
    this.loop.wake();
  }
}

/** Whether two sequences measure with the same; each time one is set it gets another number. */
function sameSequence(one: AppliedDocument, other: AppliedDocument | null): boolean {
  return other !== null && JSON.stringify({ ...one, sequence_id: 0 }) === JSON.stringify({ ...other, sequence_id: 0 });
}

type Errand = Readonly<{ resolve: (reports: readonly FrameReport[]) => void; reject: (error: Error) => void }>;

/** How long the picture stays where it is before only the part in sight is asked for. */
const SETTLED_S = 0.3;

/** How long the stream's next frame is waited for before the newest there is will do. */
const SOON_S = 0.4;

const UNKNOWN_PRODUCT = "unknown-product";

const TOKEN_PROBLEMS: readonly string[] = ["token-required", "token-refused"];
