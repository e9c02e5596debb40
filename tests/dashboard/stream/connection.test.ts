import { decode, encode } from "@msgpack/msgpack";
import { beforeEach, describe, expect, test } from "vitest";
import { type ConnectionEvent, CREDITS, FrameGone, type Socket, StreamConnection } from "../../../client/dashboard/src/stream/connection";
import type { CameraDocument } from "../../../client/dashboard/src/stream/documents";
import type { CameraState } from "../../../client/dashboard/src/stream/protocol";

class FakeSocket implements Socket {
  binaryType: BinaryType = "blob";
  onopen: Socket["onopen"] = null;
  onmessage: Socket["onmessage"] = null;
  onclose: Socket["onclose"] = null;
  readonly sent: Record<string, unknown>[] = [];
  closed = false;

  send(data: Uint8Array<ArrayBuffer>): void {
    this.sent.push(decode(data) as Record<string, unknown>);
  }

  close(): void {
    this.closed = true;
  }

  opens(): void {
    this.onopen?.({} as Event);
  }

  closes(code: number): void {
    this.onclose?.({ code, reason: "" } as CloseEvent);
  }

  receives(message: unknown): void {
    this.onmessage?.({ data: encode(message).slice().buffer } as MessageEvent<ArrayBuffer>);
  }
}

const camera = (state: CameraState): CameraDocument => ({ state, reason: null, simulated: true, capabilities: {} }) as CameraDocument;

/** A world in which time passes on command. */
class World {
  readonly sockets: FakeSocket[] = [];
  readonly events: ConnectionEvent[] = [];
  answer: () => Promise<CameraDocument> = () => Promise.resolve(camera("streaming"));
  probes = 0;
  /** What was requested, and what a request is answered with. */
  readonly requested: string[] = [];
  brings: (frame: number, product: string) => Promise<ArrayBuffer> = (frame, product) => Promise.resolve(large(frame, product));
  #now_s = 0;
  #timers = new Map<number, { due_s: number; action: () => void }>();
  #next = 1;
  readonly connection = new StreamConnection(
    "ws://camera/api/v1/stream",
    {
      openSocket: () => {
        const socket = new FakeSocket();
        this.sockets.push(socket);
        return socket;
      },
      setTimer: (action, delay_s) => {
        this.#timers.set(this.#next, { due_s: this.#now_s + delay_s, action });
        return this.#next++;
      },
      clearTimer: (timer) => this.#timers.delete(timer),
      now_s: () => this.#now_s,
      random: () => 0.5,
      probe: () => {
        this.probes += 1;
        return this.answer();
      },
      bring: ({ frame, product }, query) => {
        this.requested.push(`${frame} ${product}${query}`);
        return this.brings(frame, product);
      },
    },
    (event) => this.events.push(event),
  );

  get socket(): FakeSocket {
    return this.sockets[this.sockets.length - 1];
  }

  async passes(span_s: number): Promise<void> {
    const end_s = this.#now_s + span_s;
    for (;;) {
      const due = [...this.#timers].filter(([, { due_s }]) => due_s <= end_s).sort((a, b) => a[1].due_s - b[1].due_s);
      if (due.length === 0) break;
      const [timer, { due_s, action }] = due[0];
      this.#timers.delete(timer);
      this.#now_s = due_s;
      action();
      await Promise.resolve();
      await Promise.resolve();
    }
    this.#now_s = end_s;
  }

  get pauses_s(): number[] {
    return this.events.filter((event) => event.type === "waiting").map((event) => event.retry_s);
  }
}

const frame = (number: number): unknown => ({
  type: "frame",
  product: "range",
  meta: { frame: number },
  array: { dtype: "|u1", shape: [1], data: new Uint8Array(1) },
});

/** The message of all of a large frame. */
const large = (frame: number, product: string): ArrayBuffer =>
  encode({
    type: "frame",
    product,
    axes: ["y", "x"],
    meta: { frame, width: 640, height: 480, region: [0, 0, 640, 480], decimation: 1 },
    array: { dtype: "|u1", shape: [480, 640], data: new Uint8Array(480 * 640) },
  }).slice().buffer;

let world: World;
beforeEach(() => {
  world = new World();
  world.connection.want(["range"]);
});

describe("that is too slow", () => {
  const picture = (number: number): unknown => ({
    type: "frame",
    product: "range",
    axes: ["y", "x"],
    meta: { frame: number },
    array: { dtype: "<f4", shape: [1, 1], data: new Uint8Array(4) },
  });
  const asked = (): unknown => world.socket.sent.filter(({ type }) => type === "subscribe").at(-1)?.subscriptions;
  let number = 0;
  /** So many frames, one each `every_s`, of a camera that takes ten a second, drawn at once. */
  const come = async (frames: number, every_s: number, pictures_hz?: number): Promise<void> => {
    for (let n = 0; n < frames; n++) {
      const lost = 10 * every_s - 1;
      if (lost > 0) world.socket.receives({ type: "notice", kind: "dropped", channel: 0, count: lost, total: lost });
      if (pictures_hz !== undefined) world.connection.moved(pictures_hz);
      number += 10 * every_s;
      world.socket.receives(picture(number));
      world.connection.acknowledge(number);
      await world.passes(every_s);
    }
  };
  const ALL = [{ product: "range", max_rate_hz: null }];

  beforeEach(() => {
    number = 0;
    world.socket.opens();
  });

  test("a link is asked for smaller frames and says so, and for all when the user says", async () => {
    await come(3, 4);
    expect(asked()).toMatchObject([{ product: "range", encoding: "u16" }]);
    await come(5, 2);
    expect(asked()).toMatchObject([{ product: "range", encoding: "u16", decimation: 2 }]);
    expect(world.events.filter(({ type }) => type === "demand")).toMatchObject([
      { demand: { coded: true, part: false }, carried_bytes_s: expect.any(Number) as number, pictures_hz: null },
      { demand: { coded: true, part: true } },
    ]);
    world.connection.look([3, 4, 50, 60]);
    expect(asked()).toMatchObject([{ encoding: "u16", region: [3, 4, 50, 60] }]);
    world.connection.adapt(false);
    expect(asked()).toEqual(ALL);
    expect(world.events.at(-1)).toMatchObject({ type: "demand", demand: { coded: false, part: false } });
    await come(6, 4);
    expect(asked()).toEqual(ALL);
  });

  test("a browser is asked for fewer frames and says so", async () => {
    await come(60, 0.1, 14.5);
    expect(asked()).toEqual([{ product: "range", max_rate_hz: expect.closeTo(5, 1) as number }]);
    expect(world.events.filter(({ type }) => type === "demand")).toMatchObject([{ carried_bytes_s: null, pictures_hz: 14.5 }]);
  });

  test("all is asked for while light rests, and of another sequence", async () => {
    world.connection.look([3, 4, 50, 60]);
    await come(3, 4);
    const less = asked();
    expect(less).not.toEqual(ALL);
    world.connection.rest(true);
    expect(asked()).toEqual(ALL);
    expect(world.events.at(-1)).toMatchObject({ carried_bytes_s: null, demand: { coded: false } });
    world.connection.rest(false);
    expect(asked()).toEqual(less);
    world.socket.receives({ type: "notice", kind: "sequence-changed", sequence: {} });
    expect(asked()).toEqual(ALL);
  });

  test("large frames are requested in the part that is in sight", async () => {
    await come(15, 1, 14.5); // hardly as many frames as there could be fewer of
    expect(asked()).toMatchObject([{ decimation: 2 }]);
    world.connection.look([3, 4, 50, 60]);
    expect(asked()).toMatchObject([{ region: [3, 4, 50, 60] }]);
    world.socket.receives({ type: "hello", channels: [{ product: "range", shape: [480, 640] }] });
    world.socket.receives({
      type: "frame",
      product: "range",
      meta: { frame: 700, width: 640, height: 480, region: [0, 0, 1, 1], decimation: 1 },
      array: { dtype: "|u1", shape: [1, 1], data: new Uint8Array(1) },
    });
    expect(world.requested).toEqual(["700 range?region=3,4,50,60"]);
  });
});

describe("of large frames", () => {
  const asked = (): unknown => world.socket.sent.filter(({ type }) => type === "subscribe").at(-1)?.subscriptions;
  const acknowledged = (): unknown[] => world.socket.sent.filter(({ type }) => type === "ack").map((message) => message.frame);
  const greets = (...shape: number[]): void => {
    world.socket.receives({ type: "hello", channels: [{ product: "range", shape }] });
  };
  const announces = (frame: number, product = "range"): void => {
    world.socket.receives({
      type: "frame",
      product,
      meta: { frame, width: 640, height: 480, region: [0, 0, 1, 1], decimation: 1 },
      array: { dtype: "|u1", shape: [1, 1], data: new Uint8Array(1) },
    });
  };
  const frames = (): unknown[] =>
    world.events.flatMap((event) => (event.type === "message" && event.message.type === "frame" ? [event.message.meta.frame] : []));
  const passed = (): Promise<void> => world.passes(0.01).then(() => new Promise((done) => setTimeout(done)));

  beforeEach(() => {
    world.socket.opens();
    greets(480, 640);
  });

  test("one pixel is streamed, and all of them are requested", async () => {
    expect(asked()).toEqual([{ product: "range", max_rate_hz: null, region: [0, 0, 1, 1] }]);
    announces(7);
    await passed();
    expect(world.requested).toEqual(["7 range"]);
    expect(frames()).toEqual([7]);
    greets(1, 1);
    expect(world.socket.sent.filter(({ type }) => type === "subscribe")).toHaveLength(2); // and no third
  });

  test("small ones are streamed whole", () => {
    const before = world.socket.sent.length;
    const small = new World();
    small.connection.want(["range"]);
    small.socket.opens();
    small.socket.receives({ type: "hello", channels: [{ product: "coefficients", shape: [17, 120, 163] }] });
    expect(small.socket.sent).toHaveLength(1);
    expect(world.socket.sent).toHaveLength(before);
  });

  test("what was drawn is acknowledged once all products of the frame came", async () => {
    world.connection.want(["light", "range"]);
    announces(7, "light");
    await passed();
    world.connection.acknowledge(7);
    expect(acknowledged()).toEqual([]);
    announces(7, "range");
    await passed();
    world.connection.acknowledge(7);
    expect(acknowledged()).toEqual([7]);
  });

  test("one that is gone is left out, and where requests are refused the stream sends all again until it is opened anew", async () => {
    world.brings = () => Promise.reject(new FrameGone());
    announces(7);
    await passed();
    expect(acknowledged()).toEqual([7]);
    expect(asked()).toMatchObject([{ region: [0, 0, 1, 1] }]);
    world.brings = () => Promise.reject(new Error("the service answered 429"));
    announces(8);
    await passed();
    expect(asked()).toEqual([{ product: "range", max_rate_hz: null }]);
    world.socket.closes(1006);
    await world.passes(1);
    world.socket.opens();
    expect(asked()).toMatchObject([{ region: [0, 0, 1, 1] }]);
  });

  test("what was requested before something else was wanted is not handed on", async () => {
    announces(7);
    world.connection.want(["direct"]);
    await passed();
    expect(frames()).toEqual([]);
  });
});

describe("a stream", () => {
  test("subscribes once it is open, and again when something else is wanted", () => {
    expect(world.socket.sent).toEqual([]);
    world.socket.opens();
    world.connection.want(["coefficients", "range"]);
    const wanted = world.socket.sent.map((message) => message.subscriptions);
    expect(wanted).toEqual([
      [{ product: "range", max_rate_hz: null }],
      [
        { product: "coefficients", max_rate_hz: null },
        { product: "range", max_rate_hz: null },
      ],
    ]);
    expect(world.sockets).toHaveLength(1);
  });

  test("hands on what arrives and acknowledges what was drawn", () => {
    world.socket.opens();
    world.socket.receives(frame(7));
    expect(world.events.map((event) => event.type)).toEqual(["connecting", "open", "message"]);
    world.connection.acknowledge(7);
    expect(world.socket.sent.at(-1)).toEqual({ type: "ack", frame: 7 });
  });

  test("survives a message it cannot read", () => {
    world.socket.opens();
    world.socket.receives([1, 2, 3]);
    world.socket.receives(frame(8));
    expect(world.events.slice(-2).map((event) => event.type)).toEqual(["unreadable", "message"]);
    expect(world.socket.closed).toBe(false);
  });
});

describe("a lost stream", () => {
  test("comes back after pauses that double up to a limit", async () => {
    for (let attempt = 0; attempt < 7; attempt++) {
      world.socket.closes(1006);
      await world.passes(10);
    }
    expect(world.pauses_s).toEqual(expect.arrayContaining([0.5, 1, 2, 4, 8]));
    expect(Math.max(...world.pauses_s)).toBe(8);
  });

  test("starts with short pauses again once a message arrived", async () => {
    world.socket.closes(1006);
    await world.passes(0.6);
    world.socket.closes(1006);
    await world.passes(1.1);
    world.socket.opens();
    world.socket.receives({ type: "hello" });
    world.socket.closes(1001);
    expect(world.pauses_s).toEqual([0.5, 1, 0.5]);
    expect(world.events.at(-1)).toMatchObject({ reason: "The service is shutting down." });
  });

  test("is tried at once on request", async () => {
    world.socket.closes(1006);
    world.connection.retryNow();
    expect(world.sockets).toHaveLength(2);
    await world.passes(1);
    expect(world.sockets).toHaveLength(2); // the pause that was waited out is over
  });

  test("an attempt without an answer is given up", async () => {
    await world.passes(8);
    expect(world.socket.closed).toBe(true);
    expect(world.events.at(-1)).toMatchObject({ type: "waiting", reason: "The service does not answer." });
  });

  test("subscribes anew to what is wanted now", async () => {
    world.socket.opens();
    world.connection.want(["direct"]);
    world.socket.closes(1006);
    await world.passes(0.5);
    world.socket.opens();
    expect(world.socket.sent).toMatchObject([{ type: "subscribe", subscriptions: [{ product: "direct" }] }]);
  });
});

describe("silence", () => {
  test("makes it ask for the camera, and tell what it hears", async () => {
    world.answer = () => Promise.resolve(camera("lost"));
    world.socket.opens();
    await world.passes(3);
    expect(world.events.at(-1)).toEqual({ type: "camera", document: camera("lost") });
    expect(world.socket.closed).toBe(false);
  });

  test("of a service that does not answer either ends the connection", async () => {
    world.answer = () => Promise.reject(new Error("gone"));
    world.socket.opens();
    await world.passes(3);
    expect(world.sockets[0].closed).toBe(true);
    expect(world.events.at(-1)).toMatchObject({ type: "waiting" });
  });

  test("is no reason to ask while this page has not drawn what it was sent", async () => {
    world.socket.opens();
    for (let number = 1; number <= CREDITS; number++) world.socket.receives(frame(number));
    await world.passes(60);
    expect(world.probes).toBe(0);
    world.connection.acknowledge(CREDITS);
    await world.passes(6);
    expect(world.probes).toBeGreaterThan(0);
  });

  test("is not noticed while frames arrive", async () => {
    world.socket.opens();
    for (let number = 1; number < 40; number++) {
      world.socket.receives(frame(number));
      world.connection.acknowledge(number);
      await world.passes(0.5);
    }
    expect(world.probes).toBe(0);
  });
});

describe("a service that asks for a token", () => {
  const tokens = (): unknown[] => world.sockets.flatMap(({ sent }) => sent.map((message) => message.token));

  beforeEach(() => {
    world.socket.opens();
    world.socket.closes(4003);
  });

  test("is not asked again with the same one", async () => {
    expect(world.events.at(-1)).toEqual({ type: "refused" });
    world.connection.want(["direct"]);
    await world.passes(60);
    expect(world.sockets).toHaveLength(1);
  });

  test("is asked at once with another, which goes into the first message", () => {
    world.connection.authenticate("tc_secret");
    world.socket.opens();
    expect(tokens()).toEqual([null, "tc_secret"]);
  });

  test("hears at once that a token was given up", () => {
    world.connection.authenticate("tc_secret");
    world.socket.opens();
    world.connection.authenticate(null);
    expect(world.sockets[1].closed).toBe(true);
    world.socket.opens();
    expect(tokens()).toEqual([null, "tc_secret", null]);
  });

  test("is not asked more often because the same token is shown twice", () => {
    world.connection.authenticate("tc_secret");
    world.connection.authenticate("tc_secret");
    expect(world.sockets).toHaveLength(2);
  });
});
