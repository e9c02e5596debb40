import { beforeEach, describe, expect, test, vi } from "vitest";
import { AnimationLoop } from "../../../client/dashboard/src/store/animation";
import { Api } from "../../../client/dashboard/src/store/api";
import { StreamClient, type WorkerPort } from "../../../client/dashboard/src/store/client";
import { Store } from "../../../client/dashboard/src/store/store";
import type { AppliedDocument, FrameMeta, RecordingDocument } from "../../../client/dashboard/src/stream/documents";
import type { FrameMessage, Hello } from "../../../client/dashboard/src/stream/protocol";
import { type FrameReport, summarised } from "../../../client/dashboard/src/stream/summary";
import type { Command, Report } from "../../../client/dashboard/src/stream/worker";

const CAMERA = { state: "streaming", reason: null, simulated: true, capabilities: { model: "A" } } as const;

function frame(product: string, number: number): Report {
  const meta = { frame: number, base_frequency_hz: 23e6, host_time_s: 0 } as FrameMeta;
  const array = { dtype: "<f4", shape: [1, 2], data: Float32Array.from([number, 2]) } as const;
  return summarised({ type: "frame", product, unit: "m", axes: ["y", "x"], meta, encode_s: 0, array } as FrameMessage);
}

const hello = (state: Hello["camera"]["state"]): Report => ({
  type: "message",
  message: { type: "hello", session: "1", server: { name: "", version: "" }, sequence: null, camera: { state } },
});

class Page {
  /** Products that the camera does not have, by the service. */
  absent: readonly { readonly name: string; readonly reason: string }[] = [];
  products: readonly object[] = [];
  readonly sent: Command[] = [];
  readonly worker: WorkerPort = { onmessage: null, postMessage: (command) => this.sent.push(command) };
  readonly #requested: ((now_ms: number) => void)[] = [];
  readonly store = new Store({
    shelf: null,
    api: new Api(() =>
      Promise.resolve(
        new Response(
          JSON.stringify({
            ...CAMERA,
            absent_products: this.absent,
            estimators: [],
            products: this.products,
            active: null,
            recordings: [],
          }),
        ),
      ),
    ),
  });
  readonly client = new StreamClient(
    this.store,
    this.worker,
    new AnimationLoop((callback) => this.#requested.push(callback)),
    () => this.now_s,
  );
  now_s = 1000;

  receives(...reports: Report[]): void {
    for (const data of reports) this.worker.onmessage?.({ data } as MessageEvent<Report>);
  }

  refreshes(): void {
    for (const callback of this.#requested.splice(0)) callback(0);
  }

  get acknowledged(): number[] {
    return this.sent.filter((command) => command.type === "acknowledge").map(({ value }) => value);
  }
}

let page: Page;
beforeEach(() => {
  page = new Page();
  page.store.frames.claim(["range", "brightness"]);
  page.client.open("ws://camera/");
});

describe("between worker and store", () => {
  test("it asks for what views want, and again when that changes", () => {
    page.store.frames.claim(["coefficients"]);
    expect(page.sent).toEqual([
      { type: "open", url: "ws://camera/", products: ["brightness", "range"], token: null },
      { type: "adapt", value: true },
      { type: "want", value: ["brightness", "coefficients", "range"] },
    ]);
  });

  test("it does not ask for what the camera does not have", async () => {
    page.absent = [{ name: "brightness", reason: "it needs a zeroth moment" }];
    await page.client.learnAbsent();
    expect(page.store.frames.absent.value).toEqual({ brightness: "it needs a zeroth moment" });
    expect(page.sent.at(-1)).toEqual({ type: "want", value: ["range"] });
    expect(page.store.frames.amplitude.value).toBe("direct");
  });

  test("a product that is refused makes it look what the camera has", async () => {
    page.absent = [{ name: "brightness", reason: "it needs a zeroth moment" }];
    page.receives({ type: "message", message: { type: "error", problem: { type: "/problems/unknown-product" } } });
    await vi.waitFor(() => expect(page.sent.at(-1)).toEqual({ type: "want", value: ["range"] }));
    expect(page.store.status.unreadable.value).toBeNull();
  });

  test("frames reach the store at the next refresh, and are acknowledged then", () => {
    page.receives(frame("range", 4), frame("brightness", 4));
    expect(page.store.frames.of("range").value).toBeNull();
    expect(page.acknowledged).toEqual([]);
    page.refreshes();
    expect(page.store.frames.of("range").value?.values[0]).toBe(4);
    expect(page.store.status.newest.value?.frame).toBe(4);
    expect(page.acknowledged).toEqual([4]);
  });

  test("of what comes faster than the display only the newest is drawn", () => {
    page.receives(frame("range", 4), frame("range", 5));
    page.refreshes();
    expect(page.store.frames.of("range").value?.values[0]).toBe(5);
    expect(page.acknowledged).toEqual([5]);
  });

  test("a held page takes no frame and acknowledges none, until it is let go", () => {
    page.store.held.value = true;
    page.receives(frame("range", 4));
    page.refreshes();
    expect(page.store.frames.of("range").value).toBeNull();
    expect(page.acknowledged).toEqual([]);
    page.store.held.value = false;
    page.refreshes();
    expect(page.acknowledged).toEqual([4]);
  });

  test("a frame of which a part was sent is fetched whole when it is held", () => {
    const report = frame("range", 4) as FrameReport;
    const part = { width: 2, height: 1, region: [0, 0, 2, 1], decimation: 2 };
    const thinned = { ...report.message, meta: { ...report.message.meta, ...part } } as unknown as FrameMessage;
    page.receives(summarised(thinned));
    page.refreshes();
    page.store.held.value = true;
    const asked = page.sent.filter((command) => command.type === "bring");
    expect(asked).toEqual([{ type: "bring", ticket: 1, path: "/frames/4", products: ["range"] }]);
  });

  test.each(["a pause", "a pin"])("the worker is told once of %s, and that it ended", (what) => {
    page.store.frames.claim(["coefficients"]);
    page.store.player.playing.value = true;
    page.receives({ ...frame("coefficients", 1), light: null } as Report);
    page.refreshes();
    page.sent.length = 0;
    if (what === "a pause") page.store.player.playing.value = false;
    else page.store.measures.pins.value = [{ name: "A", pixel: { x: 0, y: 0 } }] as never;
    for (let n = 2; n < 5; n++) {
      page.receives({ ...frame("coefficients", n), light: null } as Report);
      page.refreshes();
    }
    expect(page.sent.filter(({ type }) => type === "rest")).toEqual([{ type: "rest", value: true }]);
    page.store.player.playing.value = true;
    page.store.measures.pins.value = [];
    page.receives({ ...frame("coefficients", 6), light: null } as Report);
    page.refreshes();
    expect(page.sent.filter(({ type }) => type === "rest").slice(1)).toEqual([{ type: "rest", value: false }]);
  });

  describe("how fluently light moves", () => {
    const light = (number: number): Report => ({ ...frame("coefficients", number), light: null }) as Report;
    /** 3 s of 10 refreshes a second, with frames. */
    const watches = (): Command[] => {
      const before = page.sent.length;
      for (let n = 0; n < 30; n++) {
        if (n % 2 === 0) page.receives(light(n));
        page.refreshes();
        page.now_s += 0.1;
      }
      return page.sent.slice(before).filter(({ type }) => type === "moved");
    };

    beforeEach(() => page.store.frames.claim(["coefficients"]));

    test("is counted while it plays, and while it is scrubbed", () => {
      page.store.player.playing.value = true;
      expect(watches()).toEqual([{ type: "moved", value: expect.closeTo(10, 6) as number }]);
      page.store.player.playing.value = false;
      page.store.player.scrubbed.value = true;
      expect(watches()).toHaveLength(1);
    });

    test("is not counted while it stands, the page is held or hidden, or a recording is shown", () => {
      expect(watches()).toEqual([]);
      page.store.player.playing.value = true;
      page.store.held.value = true;
      expect(watches()).toEqual([]);
      page.store.held.value = false;
      page.store.replay.loader = () => new Promise(() => undefined);
      page.store.replay.recording.value = { id: "r" } as RecordingDocument;
      expect(watches()).toEqual([]);
      page.store.replay.leave();
      page.receives(light(100));
      page.refreshes();
      page.now_s += 4.5; // refreshes do not come while the page is hidden
      page.client.hid();
      page.receives(light(101));
      page.refreshes();
      expect(page.sent.filter(({ type }) => type === "moved")).toEqual([]);
    });
  });

  test("a camera that is lost and comes back is shown in the status", () => {
    page.receives({ type: "open" }, hello("streaming"));
    expect(page.store.status.stale.value).toBe(false);
    page.receives({ type: "message", message: { type: "notice", kind: "camera-lost", reason: "unplugged" } });
    expect(page.store.status.cameraLoss.value).toEqual({ at_s: 1000, reason: "unplugged" });
    page.receives({ type: "message", message: { type: "notice", kind: "camera-back" } });
    expect(page.store.status.cameraLoss.value).toBeNull();
    expect(page.store.status.running.value).toBe(true);
  });

  test("light that is announced, and what ended it, are shown in the status", () => {
    page.receives({ type: "open" }, hello("stopped"));
    page.receives({ type: "message", message: { type: "notice", kind: "light-arming", in_s: 3 } });
    expect(page.store.status.cameraState.value).toBe("arming");
    page.receives({ type: "message", message: { type: "notice", kind: "light-off", because: "stop", reason: "the capture was stopped" } });
    expect(page.store.status.cameraState.value).toBe("stopped");
    expect(page.store.status.running.value).toBe(false);
  });

  test("a session that begins without a camera says so", () => {
    page.receives({ type: "open" }, hello("lost"));
    expect(page.store.status.cameraLoss.value).not.toBeNull();
  });

  test("a camera that another client started is asked how it is when its first frame comes", async () => {
    page.receives({ type: "open" }, hello("stopped"));
    await expect.poll(() => page.store.status.running.value).toBe(true); // what the service answers on opening
    page.store.status.cameraIs("stopped", 1000);
    page.receives(frame("range", 9));
    page.refreshes();
    await expect.poll(() => page.store.status.running.value).toBe(true);
  });

  test("drops, lost images and what could not be read are counted and shown", () => {
    page.receives(
      { type: "message", message: { type: "notice", kind: "dropped", channel: 1, count: 2, total: 9 } },
      { type: "message", message: { type: "notice", kind: "lost-images", count: 3, frame: 8 } },
      { type: "message", message: { type: "notice", kind: "lost-images", count: 1, frame: 9 } },
      { type: "message", message: { type: "error", problem: { title: "No such product" } } },
    );
    expect(page.store.status.dropped.value).toBe(9);
    expect(page.store.status.lostImages.value).toBe(4);
    expect(page.store.status.unreadable.value).toBe("No such product");
  });

  test("a lost connection is said with the time of the next attempt", () => {
    page.receives({ type: "waiting", retry_s: 2, reason: "The service cannot be reached." });
    expect(page.store.status.connection.value).toEqual({
      kind: "waiting",
      retryAt_s: 1002,
      reason: "The service cannot be reached.",
    });
    expect(page.store.status.stale.value).toBe(true);
    page.client.retryNow();
    expect(page.sent.at(-1)).toEqual({ type: "retry" });
  });

  test("while a recording is shown no frame of the camera is drawn; after that the page subscribes anew", async () => {
    page.store.replay.loader = () => new Promise(() => undefined);
    page.store.replay.recording.value = { id: "r" } as RecordingDocument;
    page.receives(frame("range", 4));
    page.refreshes();
    expect(page.store.frames.of("range").value).toBeNull();
    expect(page.acknowledged).toEqual([]);
    page.store.replay.leave();
    expect(page.sent.at(-1)).toEqual({ type: "want", value: ["brightness", "range"] });
    page.receives(frame("range", 5));
    page.refreshes();
    expect(page.store.frames.of("range").value?.values[0]).toBe(5);
  });

  test("what is fetched of a recording comes before a refresh, or says why it does not", async () => {
    const bringing = page.store.replay.loader?.("/recordings/r/frames/3", ["range"]);
    expect(page.sent.at(-1)).toEqual({ type: "bring", ticket: 1, path: "/recordings/r/frames/3", products: ["range"] });
    const brought = frame("range", 3) as FrameReport;
    page.receives({ type: "brought", ticket: 1, reports: [brought], problem: null });
    page.refreshes();
    expect(await bringing).toEqual([brought]);
    const refused = page.store.replay.loader?.("/recordings/r/frames/4", ["range"]);
    page.receives({ type: "brought", ticket: 2, reports: [], problem: { title: "No such frame" } });
    await expect(refused).rejects.toThrow("No such frame");
  });

  test("a service that requires a token makes the page ask for one, and hears of it", () => {
    const problem = { type: "/problems/token-required", title: "Authentication required", status: 401 };
    page.receives({ type: "message", message: { type: "error", problem } }, { type: "refused" });
    expect(page.store.status.unreadable.value).toBeNull();
    expect(page.store.status.connection.value).toEqual({ kind: "refused" });
    expect(page.store.dialog.value).toBe("token");
    page.store.api.credentials.use("tc_secret");
    expect(page.sent.at(-1)).toEqual({ type: "authenticate", token: "tc_secret" });
  });

  test("notices become what happened", () => {
    page.receives({ type: "message", message: { type: "notice", kind: "lease-changed", change: "granted", holder: "bench 2" } });
    page.receives({ type: "message", message: { type: "notice", kind: "lost-images", count: 2, frame: 9 } });
    expect(page.store.events.all.value.map(({ words }) => words)).toEqual([
      "bench 2 has taken control.",
      expect.stringMatching(/^2 images did not arrive intact/),
    ]);
  });

  test("a sequence that was set anew and is what it was is no news", () => {
    const sequence = { sequence_id: 1, harmonics: 4, base_frequency_hz: 23e6, exposure_s: 1e-3, images: 20 };
    const changed = (change: object): void =>
      page.receives({
        type: "message",
        message: {
          type: "notice",
          kind: "sequence-changed",
          channels: [],
          sequence: { ...sequence, ...change } as unknown as AppliedDocument,
        },
      });
    changed({});
    changed({ sequence_id: 2 });
    expect(page.store.events.all.value).toHaveLength(1);
    changed({ sequence_id: 3, harmonics: 5 });
    expect(page.store.events.all.value).toHaveLength(2);
  });
});

test("products of other packages are maps beside ours, whichever the link names", async () => {
  page.store.mapProduct.value = "range-apart";
  expect(page.store.looks.of("range-apart").product.product).toBe("range");
  page.products = [
    { name: "uniform", unit: "DN", summary: "ours", stated: null },
    { name: "range-apart", unit: "m", summary: "how far apart", stated: { assumptions: "", cost: "", failure: "" } },
  ];
  await page.client.learnAbsent();

  expect(page.store.frames.maps.value.map(({ name }) => name).slice(5)).toEqual(["Error", "Range apart"]);
  expect(page.store.looks.of("range-apart").product).toMatchObject({ unit: "m", hint: "how far apart" });
  expect(page.store.looks.of("range-apart-difference").product.signed).toBe(true);
});
