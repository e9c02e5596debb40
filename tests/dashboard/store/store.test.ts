import { effect, signal } from "@preact/signals";
import { describe, expect, test } from "vitest";

import { Api, RequestError } from "../../../client/dashboard/src/store/api";
import { type Frame, Frames } from "../../../client/dashboard/src/store/frames";
import { Player } from "../../../client/dashboard/src/store/player";
import { aBoolean, aNumber, oneOf, type Setting, Settings, type Shelf } from "../../../client/dashboard/src/store/settings";
import { Status } from "../../../client/dashboard/src/store/status";
import type { FrameMeta } from "../../../client/dashboard/src/stream/documents";

const meta = (frame: number, host_time_s = 0): FrameMeta => ({ frame, host_time_s }) as FrameMeta;
const frame = (product: string, number: number): Frame => ({ product, meta: meta(number) }) as Frame;

describe("frames", () => {
  test("what two views want is streamed once, until both have gone", () => {
    const frames = new Frames();
    const first = frames.claim(["range", "brightness"]);
    const second = frames.claim(["coefficients", "brightness"]);
    expect(frames.wanted.value).toEqual(["brightness", "coefficients", "range"]);
    first();
    expect(frames.wanted.value).toEqual(["brightness", "coefficients"]);
    second();
    expect(frames.wanted.value).toEqual([]);
  });

  test("only the newest of a product is kept, and nothing of what no view wants", () => {
    const frames = new Frames();
    const giveBack = frames.claim(["range"]);
    frames.put(frame("range", 1));
    frames.put(frame("range", 2));
    frames.put(frame("direct", 2));
    expect(frames.of("range").value?.meta.frame).toBe(2);
    expect(frames.of("direct").value).toBeNull();
    giveBack();
    expect(frames.of("range").value).toBeNull();
  });

  test("a claim that changes nothing does not subscribe anew", () => {
    const frames = new Frames();
    frames.claim(["range"]);
    let notified = 0;
    effect(() => {
      notified += frames.wanted.value.length;
    });
    frames.claim(["range"]);
    expect(notified).toBe(1);
  });
});

describe("the player", () => {
  const period_s = signal(40e-9);
  const player = new Player(period_s);

  test("lets flight pass at its speed while it plays, around the period", () => {
    player.speed_ns.value = 10;
    expect(player.advance(1)).toBe(false);
    player.toggle();
    expect(player.advance(1)).toBe(true);
    expect(player.time_s.value).toBeCloseTo(10e-9, 15);
    player.advance(3.5);
    expect(player.time_s.value).toBeCloseTo(5e-9, 15);
    expect(player.phase_rad.value).toBeCloseTo(Math.PI / 4, 9);
  });

  test("plays only while there is light, and is moved by hand to any time", () => {
    player.seek(0);
    player.playing.value = true;
    player.lit.value = { first: 0.25, last: 0.5 };
    player.advance(0.001);
    expect(player.turn.value).toBe(0.25);
    player.seek(0.4999);
    player.advance(0.01);
    expect(player.turn.value).toBe(0.25);
    player.seek(0.9);
    expect(player.turn.value).toBe(0.9);
    player.gaps.value = [{ first: 0.3, last: 0.4 }];
    player.seek(0.3);
    player.advance(0.001);
    expect(player.turn.value).toBe(0.4);
    player.gaps.value = [
      { first: 0, last: 0.3 },
      { first: 0.45, last: 1 },
    ];
    player.seek(0.46);
    player.advance(0.001);
    expect(player.turn.value).toBe(0.3); // over the end, without a dark picture
    [player.playing.value, player.lit.value, player.gaps.value] = [false, null, []];
  });

  test("jumps between the arrivals of light, around the period", () => {
    player.arrivals.value = [0.2, 0.6];
    player.seek(0.3);
    const turns = [true, true, false, false].map((forward) => {
      player.jump(forward);
      return player.turn.value;
    });
    expect(turns).toEqual([0.6, 0.2, 0.6, 0.2]);
    player.arrivals.value = [];
    player.jump(true);
    expect(player.turn.value).toBe(0.2);
  });

  test("begins at the first arrival of light, unless another time was chosen before", () => {
    const fresh = new Player(period_s);
    fresh.learn({ first: 0.25, last: 0.5 }, [0.3, 0.4], []);
    expect([fresh.turn.value, fresh.lit.value?.first]).toEqual([0.3, 0.25]);
    fresh.seek(0);
    fresh.learn({ first: 0.25, last: 0.5 }, [0.31], []);
    expect([fresh.turn.value, fresh.arrivals.value]).toEqual([0, [0.31]]);
    const linked = new Player(period_s);
    linked.seek(0.7);
    linked.learn(null, [0.3], []);
    expect(linked.turn.value).toBe(0.7);
  });

  test("lets a short flight pass slowly enough to be seen, until a speed is chosen", () => {
    const fresh = new Player(period_s);
    const learn = (last: number, ...gaps: { first: number; last: number }[]): number => {
      fresh.learn({ first: 0.25, last }, [0.3], gaps);
      return fresh.speed_ns.value;
    };
    expect(learn(0.5)).toBe(5); // 10 ns in 2 s
    expect(learn(0.3)).toBe(1); // 2 ns in 2 s
    expect(learn(0.5, { first: 0.1, last: 0.35 })).toBe(2); // 6 of 10 ns
    fresh.speed_ns.value = 20;
    expect(learn(0.3)).toBe(20);
  });

  test("steps back over the start to the end", () => {
    player.seek(0);
    player.step(-1e-9);
    expect(player.time_s.value).toBeCloseTo(39e-9, 15);
  });

  test("seeks no further than the period", () => {
    player.seek(1.7);
    expect(player.time_s.value).toBe(40e-9);
    player.seek(-3);
    expect(player.time_s.value).toBe(0);
  });
});

describe("the status", () => {
  test("counts a frame once, however many of its products are drawn", () => {
    const status = new Status();
    for (let n = 1; n <= 21; n++) {
      status.frameDrawn(meta(n), 10 + n / 20);
      status.frameDrawn(meta(n), 10 + n / 20 + 0.001);
    }
    expect(status.rate_hz.value).toBeCloseTo(20, 6);
  });

  test("knows the rate of a camera that takes long for a frame", () => {
    const status = new Status();
    for (let n = 0; n < 5; n++) status.frameDrawn(meta(n + 1), 8 * n);
    expect(status.rate_hz.value).toBeCloseTo(1 / 8, 9);
  });

  test("tells how old frames are when they are drawn", () => {
    const status = new Status();
    for (let n = 1; n < 50; n++) status.frameDrawn(meta(n, 100 + n), 100 + n + 0.08);
    expect(status.latency_s.value).toBeCloseTo(0.08, 6);
  });

  test("a lost camera is stale at once, keeps the time it went, and is forgotten when it is back", () => {
    const status = new Status();
    status.connection.value = { kind: "open" };
    status.frameDrawn(meta(1), 10);
    status.frameDrawn(meta(2), 10.1);
    status.cameraIs("lost", 11, "unplugged");
    status.cameraIs("lost", 12);
    expect(status.stale.value).toBe(true);
    expect(status.cameraLoss.value).toEqual({ at_s: 11, reason: "unplugged" });
    expect(status.rate_hz.value).toBeNull();
    status.cameraIs("streaming", 13);
    expect(status.stale.value).toBe(false);
  });

  test("drops of several channels are those of the worst, and start anew with a session", () => {
    const status = new Status();
    status.dropNotice(0, 3);
    status.dropNotice(1, 5);
    status.dropNotice(0, 4);
    expect(status.dropped.value).toBe(5);
    status.sessionOpened("streaming", 0);
    expect(status.dropped.value).toBe(0);
  });
});

describe("settings", () => {
  class MemoryShelf implements Shelf {
    readonly items = new Map<string, string>();
    getItem(key: string): string | null {
      return this.items.get(key) ?? null;
    }
    setItem(key: string, value: string): void {
      this.items.set(key, value);
    }
  }
  const TONE: Setting<string> = { key: "tone", link: "tone", initial: "linear", ...oneOf(["linear", "root"]) };
  const kept = (items: Record<string, string>): MemoryShelf => {
    const shelf = new MemoryShelf();
    for (const [key, text] of Object.entries(items)) shelf.items.set(key, text);
    return shelf;
  };

  test("are found again", () => {
    const shelf = new MemoryShelf();
    new Settings(shelf).of(TONE).value = "root";
    expect(new Settings(shelf).of(TONE).value).toBe("root");
    expect(shelf.items).toEqual(new Map([["transientcam.tone", '"root"']]));
  });

  test("have one value, whoever asks", () => {
    const settings = new Settings(null);
    expect(settings.of(TONE)).toBe(settings.of(TONE));
  });

  test.each(['"cubic"', "{", "null"])("that are damaged, or of another version, are as if they were not there: %s", (damaged) => {
    expect(new Settings(kept({ "transientcam.tone": damaged })).of(TONE).value).toBe("linear");
  });

  test("work where the browser keeps nothing", () => {
    const refuse = (): never => {
      throw new Error("denied");
    };
    const tone = new Settings({ getItem: refuse, setItem: refuse }).of(TONE);
    tone.value = "root";
    expect(tone.value).toBe("root");
  });

  test("follow a link before they are declared and after, and keep what it does not say or says wrong", () => {
    const settings = new Settings(kept({ "transientcam.tone": '"root"' }));
    settings.follow("#tone=linear");
    const tone = settings.of(TONE);
    expect(tone.value).toBe("linear");
    for (const hash of ["#tone=root", "#tone=cubic", "#tone=", "", "#other=linear"]) {
      settings.follow(hash);
      expect(tone.value).toBe("root");
    }
  });

  test("stand in a copied link, and in the page's own address where that follows them", () => {
    const settings = new Settings(null);
    settings.of(TONE);
    settings.of<number | null>({
      link: "row",
      followed: true,
      initial: null,
      text: (row) => (row === null ? "" : String(row)),
      parse: Number,
    }).value = 7;
    expect([settings.hash(true), settings.hash(false)]).toEqual(["#tone=linear&row=7", "#row=7"]);
    expect(new Settings(null).hash(true)).toBe("");
  });

  test("that stand together in a link are taken over together or not at all", () => {
    const settings = new Settings(null);
    const GAIN: Setting<number> = { initial: 1, ...aNumber(0, 10) };
    const LIT: Setting<boolean> = { initial: false, ...aBoolean("lit", "dark") };
    settings.together("look", [TONE, GAIN, LIT]);
    settings.follow("#look=root,2.5,lit");
    expect([TONE, GAIN, LIT].map((each) => settings.of<unknown>(each).value)).toEqual(["root", 2.5, true]);
    for (const wrong of ["linear,3", "linear,11,dark", "linear,,dark", "cubic,3,dark", "linear,3,dark,more"])
      settings.follow(`#look=${wrong}`);
    expect(settings.hash(true)).toBe("#tone=root&look=root,2.5,lit");
  });
});

describe("requests", () => {
  const answering = (body: string, status: number, type: string): Api =>
    new Api(() => Promise.resolve(new Response(body, { status, headers: { "Content-Type": type } })));

  test("a problem becomes its own words, and keeps the field it names", async () => {
    const problem = { title: "Invalid sequence", detail: "harmonics is 99, but must be from 1 to 32.", field: "harmonics" };
    const api = answering(JSON.stringify(problem), 422, "application/problem+json");
    const refusal = await api.ask("GET /camera").catch((error: unknown) => error);
    expect(refusal).toBeInstanceOf(RequestError);
    expect((refusal as RequestError).message).toBe(problem.detail);
    expect((refusal as RequestError).problem).toMatchObject({ status: 422, field: "harmonics" });
  });

  test("a proxy's page says at least its status", async () =>
    await expect(answering("<html>", 502, "text/html").ask("GET /camera")).rejects.toThrow(/502/));

  test("a service that cannot be reached says that", async () => {
    const api = new Api(() => Promise.reject(new TypeError("Failed to fetch")));
    await expect(api.ask("GET /camera")).rejects.toThrow("The service cannot be reached.");
  });
});
