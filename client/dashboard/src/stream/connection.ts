/**
 * One stream that stays: connects, subscribes, notices when the other end is gone, and comes back.
 *
 * Knows no worker and no page. The socket, the clock, chance and the probe are arguments.
 */
import { Announced, type Announcement } from "./announced";
import { codesFor } from "./compact";
import { type Decision, type Demand, DemandControl, EVERYTHING } from "./demand";
import type { CameraDocument } from "./documents";
import {
  ANNOUNCING,
  decodeMessage,
  encodeAck,
  encodeSubscribe,
  type Hello,
  LEAST_PRODUCTS,
  ProtocolError,
  type ServerMessage,
  SUBPROTOCOL,
  type Subscription,
} from "./protocol";

/** What of a WebSocket is used. */
export interface Socket {
  binaryType: BinaryType;
  onopen: ((event: Event) => void) | null;
  onmessage: ((event: MessageEvent<ArrayBuffer>) => void) | null;
  onclose: ((event: CloseEvent) => void) | null;
  send(data: Uint8Array<ArrayBuffer>): void;
  close(code?: number, reason?: string): void;
}

export interface Surroundings {
  openSocket(url: string, protocol: string): Socket;
  setTimer(action: () => void, delay_s: number): number;
  clearTimer(timer: number): void;
  /** Time of any clock that never goes back. */
  now_s(): number;
  /** A number in [0, 1). */
  random(): number;
  /** Asks the service whether it is there; resolves to what it says of the camera, rejects if it is not. */
  probe(): Promise<CameraDocument>;
  /** Requests a product of a frame as a message, of the part that the query names; rejects where it cannot be had. */
  bring(announcement: Announcement, query: string): Promise<ArrayBuffer>;
}

export type ConnectionEvent =
  | { readonly type: "connecting" }
  | { readonly type: "open" }
  | { readonly type: "waiting"; readonly retry_s: number; readonly reason: string }
  | { readonly type: "refused" }
  | { readonly type: "message"; readonly message: ServerMessage }
  | { readonly type: "camera"; readonly document: CameraDocument }
  | ({ readonly type: "demand" } & Decision)
  | { readonly type: "unreadable"; readonly reason: string };

/** Frames the service may send ahead of what was drawn. */
export const CREDITS = 2;

/** Frames of so many pixels are announced by the stream, and requested: smaller ones come sooner as messages. */
const LARGE_PIXELS = 2 ** 16;
const FIRST_RETRY_S = 0.5;
const LONGEST_RETRY_S = 8;
/** The service admits no client without a valid token. */
const NOT_LET_IN = 4003;
/** Silence after which the service is asked whether it is still there. */
const SILENCE_S = 3;

export class StreamConnection {
  #products: readonly string[] = [];
  #token: string | null = null;
  #refused = false;
  #socket: Socket | null = null;
  #open = false;
  #attempts = 0;
  #timer: number | null = null;
  #inFlight = new Set<number>();
  readonly #control = new DemandControl();
  #adapts = true;
  /** The part of the picture in sight: column and row of its first pixel, width and height; null for all of it. */
  #sight: readonly number[] | null = null;
  /** In which codes each product can be sent that came once. */
  readonly #codes = new Map<string, string | null>();
  readonly #announced: Announced;
  /** The camera's frames are large, and requests for them were not refused. */
  #large = false;
  #refusesRequests = false;

  constructor(
    private readonly url: string,
    private readonly around: Surroundings,
    private readonly emit: (event: ConnectionEvent) => void,
  ) {
    this.#announced = new Announced(
      (announcement) => around.bring(announcement, queryOf(this.#cut)),
      (body) => this.#receive(body),
      ({ frame }, error) => this.#missed(frame, error),
    );
  }

  /** Sets what is streamed, connecting if there is no connection. */
  want(products: readonly string[]): void {
    this.#products = products;
    if (this.#open) this.#subscribe();
    else if (this.#socket === null && this.#timer === null && !this.#refused) this.#connect();
  }

  /** Sets whether less is asked for where link or page are too slow for all. */
  adapt(adapts: boolean): void {
    if (adapts === this.#adapts) return;
    this.#adapts = adapts;
    this.#askForAll();
  }

  /** Sets which part of the picture is in sight. */
  look(sight: readonly number[] | null): void {
    this.#sight = sight;
    if (this.#open && this.#demand.part) this.#subscribe();
  }

  /** Shows this token from now on; a service that refused the one before is asked anew. */
  authenticate(token: string | null): void {
    if (token === this.#token) return;
    this.#token = token;
    // A connected client may stay; a token that is given up, or another one, must count at once.
    if (this.#socket !== null) this.#drop();
    else if (this.#timer === null && !this.#refused) return;
    this.retryNow();
  }

  /** Frame `frame` and all before it were drawn: the service may send on. */
  acknowledge(frame: number): void {
    const done = Math.min(frame, this.#announced.done); // the service keeps a frame whose products are still requested
    const known = this.#inFlight.size;
    for (const number of this.#inFlight) if (number <= done) this.#inFlight.delete(number);
    if (this.#inFlight.size === 0) this.#control.drewAll(this.around.now_s());
    if (this.#open && (done === frame || this.#inFlight.size < known)) this.#socket?.send(encodeAck(done));
  }

  /** Pictures a second of light that moves on the page. */
  moved(pictures_hz: number): void {
    this.#control.pictured(pictures_hz);
  }

  /** Light stands still or is measured from now on, or does not any more. */
  rest(rests: boolean): void {
    const asked = this.#demand;
    this.#control.rest(rests);
    if (this.#demand !== asked) this.#askAnew();
  }

  /** Tries at once instead of waiting out the pause between attempts. */
  retryNow(): void {
    if (this.#socket !== null) return;
    this.#clear();
    this.#refused = false;
    this.#connect();
  }

  #connect(): void {
    this.emit({ type: "connecting" });
    const socket = this.around.openSocket(this.url, SUBPROTOCOL);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#open = true;
      this.#refusesRequests = false;
      this.#inFlight.clear();
      this.#subscribe();
      this.emit({ type: "open" });
      this.#listen();
    };
    socket.onmessage = ({ data }) => this.#receive(data);
    socket.onclose = ({ code, reason }) => {
      if (code === NOT_LET_IN) this.#refuse();
      else this.#lost(reason || CLOSE_REASONS[code] || "The connection was closed.");
    };
    // An attempt that neither opens nor fails (a firewall that swallows it) ends here.
    this.#rearm(() => this.#lost("The service does not answer."), LONGEST_RETRY_S);
  }

  #subscribe(): void {
    const products = this.#products.length === 0 ? LEAST_PRODUCTS : this.#products;
    this.#inFlight.clear(); // the service forgets them too
    this.#announced.clear();
    this.#control.restart();
    const subscriptions = products.map((product) => this.#subscriptionOf(product));
    this.#socket?.send(encodeSubscribe(subscriptions, CREDITS, this.#token));
  }

  #subscriptionOf(product: string): Subscription {
    const { maxRate_hz, coded } = this.#demand;
    if (this.#announces) return { product, max_rate_hz: maxRate_hz, region: ANNOUNCING };
    const encoding = coded ? this.#codes.get(product) : null;
    return { product, max_rate_hz: maxRate_hz, ...(encoding == null ? {} : { encoding }), ...this.#cut };
  }

  /** Whether frames are announced; only the stream has codes. */
  get #announces(): boolean {
    return this.#large && !this.#refusesRequests && !this.#demand.coded;
  }

  /** Which pixels are asked for. */
  get #cut(): Pick<Subscription, "region" | "decimation"> {
    if (!this.#demand.part) return {};
    return this.#sight === null ? { decimation: 2 } : { region: this.#sight };
  }

  /** Large frames are announced from now on. */
  #greeted({ channels }: Hello): void {
    if (this.#large || !(channels ?? []).some(({ shape }) => shape.slice(-2).reduce((a, b) => a * b, 1) >= LARGE_PIXELS)) return;
    this.#large = true;
    if (this.#announces) this.#subscribe();
  }

  /** A request was in vain: that of a frame that is gone is left out, else the stream sends all frames itself. */
  #missed(frame: number, error: unknown): void {
    if (error instanceof FrameGone) {
      this.acknowledge(frame);
      return;
    }
    this.#refusesRequests = true;
    if (this.#open) this.#subscribe();
  }

  get #demand(): Demand {
    return this.#control.demand;
  }

  #askForAll(): void {
    const asked = this.#demand;
    this.#control.reset();
    if (asked !== EVERYTHING) this.#askAnew();
  }

  /** Says what is asked for now, and asks for it. */
  #askAnew(): void {
    this.emit({ type: "demand", ...this.#control.decision });
    if (this.#open) this.#subscribe();
  }

  /** What a message says of the link. */
  #weigh(message: ServerMessage, bytes: number): void {
    if (!this.#adapts) return;
    if (message.type === "notice" && message.kind === "dropped")
      this.#control.dropped(message.channel, message.unacknowledged ?? message.count);
    if (message.type === "notice" && message.kind === "sequence-changed") this.#askForAll();
    if (message.type !== "frame") return;
    const { product, axes, array, meta } = message;
    this.#codes.set(product, codesFor(axes, array.dtype));
    if (this.#control.arrived(this.around.now_s(), meta.frame, bytes)) this.#askAnew();
  }

  #receive(data: ArrayBuffer): void {
    this.#attempts = 0;
    this.#listen();
    const bytes = data.byteLength; // who gets the message may transfer its buffer
    try {
      const message = decodeMessage(data);
      if (message === null) return;
      if (message.type === "announcement") {
        this.#inFlight.add(message.frame);
        if (this.#announces) this.#announced.add(message, Math.max(1, this.#products.length));
        return;
      }
      if (message.type === "frame") this.#inFlight.add(message.meta.frame);
      this.emit({ type: "message", message });
      if (message.type === "hello") this.#greeted(message);
      this.#weigh(message, bytes);
    } catch (error) {
      if (!(error instanceof ProtocolError)) throw error;
      this.emit({ type: "unreadable", reason: error.message });
    }
  }

  /** Starts the wait for the next message anew. */
  #listen(): void {
    this.#rearm(() => {
      // Frames we were sent and did not draw (a hidden or held page) explain the silence.
      if (this.#inFlight.size >= CREDITS) this.#listen();
      else void this.#probe();
    }, SILENCE_S);
  }

  async #probe(): Promise<void> {
    const socket = this.#socket;
    try {
      const document = await this.around.probe();
      if (this.#socket !== socket) return;
      this.emit({ type: "camera", document });
      this.#listen();
    } catch {
      if (this.#socket === socket) this.#lost("The service does not answer.");
    }
  }

  #lost(reason: string): void {
    this.#drop();
    const pause_s = Math.min(LONGEST_RETRY_S, FIRST_RETRY_S * 2 ** this.#attempts);
    const retry_s = pause_s * (0.8 + 0.4 * this.around.random()); // many pages must not come at once
    this.#attempts += 1;
    this.emit({ type: "waiting", retry_s, reason });
    this.#rearm(() => {
      this.#timer = null;
      this.#connect();
    }, retry_s);
  }

  /** Waits for a token: trying again with the same one would be refused again. */
  #refuse(): void {
    this.#clear();
    this.#drop();
    this.#refused = true;
    this.emit({ type: "refused" });
  }

  #drop(): void {
    const socket = this.#socket;
    this.#socket = null;
    this.#open = false;
    this.#announced.clear();
    if (socket === null) return;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
  }

  #rearm(action: () => void, delay_s: number): void {
    this.#clear();
    this.#timer = this.around.setTimer(action, delay_s);
  }

  #clear(): void {
    if (this.#timer !== null) this.around.clearTimer(this.#timer);
    this.#timer = null;
  }
}

/** A frame is not kept any more. */
export class FrameGone extends Error {
  override readonly name = "FrameGone";
}

/** The query for part of a frame. */
function queryOf({ region, decimation }: Pick<Subscription, "region" | "decimation">): string {
  if (region !== undefined) return `?region=${region.join()}`;
  return decimation === undefined ? "" : `?decimation=${decimation}`;
}

const CLOSE_REASONS: Record<number, string> = {
  1001: "The service is shutting down.",
  1006: "The service cannot be reached.",
  1008: "The service refuses this page.",
  1013: "The service has as many watchers as it can serve.",
  4001: "The service does not understand this page: it may be another version.",
};
