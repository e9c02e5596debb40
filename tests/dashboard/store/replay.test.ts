import { beforeEach, describe, expect, test } from "vitest";

import { RequestError } from "../../../client/dashboard/src/store/api";
import { Frames } from "../../../client/dashboard/src/store/frames";
import { Replay } from "../../../client/dashboard/src/store/replay";
import { Status } from "../../../client/dashboard/src/store/status";
import type { FrameMessage } from "../../../client/dashboard/src/stream/protocol";
import { type FrameReport, summarised } from "../../../client/dashboard/src/stream/summary";
import { answering } from "../answering";

const TIMES = [0, 0.1, 0.2, 0.3, 1.4, 1.5]; // the camera was lost for a second

function report(product: string, number: number): FrameReport {
  const array = { dtype: "<f4", shape: [1, 2], data: Float32Array.from([number, 2]) } as const;
  return summarised({
    type: "frame",
    product,
    unit: "m",
    axes: ["y", "x"],
    meta: { frame: number, base_frequency_hz: 23e6 },
    encode_s: 0.001,
    array,
  } as unknown as FrameMessage);
}

class Screen {
  readonly frames = new Frames();
  readonly status = new Status();
  readonly asked: string[] = [];
  /** What is asked for waits here until it is answered. */
  readonly waiting: (() => void)[] = [];
  refusal: RequestError | null = null;
  readonly replay = new Replay(
    answering({
      "GET /recordings/{recording}": ({ of }) => ({ id: of, name: "corner", state: "complete" }),
      "GET /recordings/{recording}/frames": ({ of }) =>
        of === "empty"
          ? { first: null, last: null, count: 0, times_s: [], times_step: 1 }
          : { first: 1, last: 6, count: 6, duration_s: 1.5, host_time_s: 5, times_s: TIMES, times_step: 1 },
    }),
    this.frames,
    this.status,
  );

  constructor() {
    this.frames.claim(["range"]);
    this.replay.loader = (path, products) => {
      this.asked.push(`${path} ${products.join()}`);
      const number = Number(path.split("/").pop());
      return new Promise((resolve, reject) => {
        this.waiting.push(() => {
          if (this.refusal !== null) reject(this.refusal);
          else resolve(products.map((product) => report(product, number)));
        });
      });
    };
  }

  get shown(): number | undefined {
    return this.frames.of("range").peek()?.values[0];
  }

  async answer(): Promise<void> {
    this.waiting.shift()?.();
    await new Promise((done) => setTimeout(done));
  }
}

let screen: Screen;
beforeEach(async () => {
  screen = new Screen();
  await screen.replay.open("20261120T081500Z-3f9c2a");
});

describe("a recording on the page", () => {
  test("begins with its first frame, which all views get from the store", async () => {
    expect(screen.replay.active.value).toBe(true);
    expect(screen.asked).toEqual(["/recordings/20261120T081500Z-3f9c2a/frames/1 range"]);
    await screen.answer();
    expect(screen.shown).toBe(1);
    expect(screen.replay.shown.value).toBe(1);
    expect(screen.frames.of("range").value?.origin).toBe("/recordings/20261120T081500Z-3f9c2a/frames/1");
    expect(screen.status.newest.value?.frame).toBe(1);
    expect(screen.status.encode_s.value).toBeCloseTo(0.001);
  });

  test("is asked for one frame at a time: what is scrubbed over meanwhile is not", async () => {
    for (const frame of [2, 3, 4, 5]) screen.replay.seek(frame);
    expect(screen.asked).toHaveLength(1);
    await screen.answer();
    expect(screen.asked.at(-1)).toContain("/frames/5 ");
    await screen.answer();
    expect([screen.asked.length, screen.shown]).toEqual([2, 5]);
  });

  test("is asked again for what another view wants of the same frame", async () => {
    await screen.answer();
    screen.frames.claim(["flags"]);
    expect(screen.asked.at(-1)).toContain("/frames/1 flags,range");
  });

  test("plays at its speed, with the pauses it was captured with, and stops at its end", async () => {
    await screen.answer();
    screen.replay.speed.value = 2;
    screen.replay.toggle();
    expect(screen.replay.advance(0.06)).toBe(true); // 0.12 s
    expect(screen.replay.frame.value).toBe(2);
    screen.replay.advance(0.5); // 1.12 s: nothing was captured since 0.3 s
    expect(screen.replay.frame.value).toBe(4);
    expect(screen.replay.advance(0.5)).toBe(false);
    expect([screen.replay.frame.value, screen.replay.playing.value]).toEqual([6, false]);
    screen.replay.toggle();
    expect(screen.replay.frame.value).toBe(1); // from the start again
  });

  test("is stepped through, no further than it goes", () => {
    screen.replay.toggle();
    screen.replay.step(1);
    expect([screen.replay.frame.value, screen.replay.playing.value]).toEqual([2, false]);
    screen.replay.step(-5);
    expect(screen.replay.frame.value).toBe(1);
    screen.replay.seek(99);
    expect(screen.replay.frame.value).toBe(6);
  });

  test("whose frame cannot be had says why, and goes on with the next", async () => {
    screen.refusal = new RequestError({ title: "The recording is damaged here." });
    screen.replay.toggle();
    await screen.answer();
    expect(screen.replay.trouble.value).toBe("The recording is damaged here.");
    expect(screen.replay.playing.value).toBe(false);
    screen.refusal = null;
    screen.replay.step(1);
    await screen.answer();
    expect([screen.shown, screen.replay.trouble.value]).toEqual([2, null]);
  });

  test("is computed anew with the present settings, whenever they change", async () => {
    await screen.answer();
    screen.replay.recompute(); // nothing to do with how it was recorded
    expect(screen.asked).toHaveLength(1);
    screen.replay.settings.value = "current";
    expect(screen.asked.at(-1)).toContain("/frames/1?reconstruction=current range");
    await screen.answer();
    screen.replay.recompute();
    expect(screen.asked).toHaveLength(3);
  });

  test("of very many frames tells the time of some, and the others lie between", () => {
    const times_s = [0, 0.3, 0.9];
    screen.replay.timeline.value = {
      first: 1,
      last: 7,
      count: 7,
      duration_s: 0.9,
      frame_rate_hz: null,
      host_time_s: 0,
      times_s,
      times_step: 3,
    };
    expect([1, 2, 4, 5, 6, 7].map((frame) => screen.replay.timeOf(frame))).toEqual(
      [0, 0.1, 0.3, 0.5, 0.7, 0.9].map((time) => expect.closeTo(time, 9)),
    );
  });

  test("is left at once: a frame that is on its way does not come any more", async () => {
    screen.replay.leave();
    await screen.answer();
    expect(screen.shown).toBeUndefined();
    expect(screen.replay.active.value).toBe(false);
    expect(screen.waiting).toHaveLength(0);
  });

  test("without frames is not opened", async () => await expect(screen.replay.open("empty")).rejects.toThrow("corner holds no frames."));
});
