import { describe, expect, test } from "vitest";

import { type Demand, DemandControl, EVERYTHING } from "../../src/stream/demand";

interface Way {
  readonly camera_hz: number;
  /** Bytes of a whole frame, and bytes a second that the link carries. */
  readonly frame_bytes: number;
  readonly link_bytes_s: number;
  /** How long the page takes to draw a frame. */
  readonly draw_s?: number;
}

/**
 * A service that sends the newest frame of those that are due as soon as the link is free, and counts the rest; a page that
 * draws what arrives. Times pass as the frames say.
 */
class Stream {
  readonly control = new DemandControl();
  now_s = 0;
  #free_s = 0;
  #due_s = 0;
  #frame = 0;

  runs(span_s: number, { camera_hz, frame_bytes, link_bytes_s, draw_s = 0.01 }: Way): Demand {
    const end_s = this.now_s + span_s;
    let [lost, waits] = [0, false];
    for (; this.now_s < end_s; this.now_s += TICK_S) {
      if (this.now_s >= this.#frame / camera_hz) {
        this.#frame += 1;
        if (this.#isDue(camera_hz)) {
          if (waits) lost += 1; // the one before it, which did not go out yet
          waits = true;
        }
      }
      if (!waits || this.now_s < this.#free_s) continue;
      waits = false;
      const { coded, part } = this.control.demand;
      const bytes = (frame_bytes * (coded ? 0.58 : 1)) / (part ? 4 : 1);
      const arrives_s = this.now_s + bytes / link_bytes_s;
      this.#free_s = Math.max(arrives_s, this.now_s + draw_s);
      if (lost > 0) this.control.dropped(0, lost);
      lost = 0;
      const decision = this.control.arrived(arrives_s, this.#frame, bytes);
      this.control.drewAll(arrives_s + draw_s);
      if (decision !== null) this.control.restart();
    }
    return this.control.demand;
  }

  /** As the service limits rates: by schedule, a little early too, anew after a pause. */
  #isDue(camera_hz: number): boolean {
    const { maxRate_hz } = this.control.demand;
    if (maxRate_hz === null) return true;
    const period_s = 1 / maxRate_hz;
    if (this.now_s < this.#due_s - 0.1 / camera_hz) return false;
    this.#due_s = (this.now_s - this.#due_s > period_s ? this.now_s : this.#due_s) + period_s;
    return true;
  }
}

const TICK_S = 0.002;
const CAMERA = { camera_hz: 10, frame_bytes: 1e6 };

describe("what is asked for", () => {
  test("is everything over a link that carries it", () =>
    expect(new Stream().runs(60, { ...CAMERA, link_bytes_s: 20e6 })).toEqual(EVERYTHING));

  test("is fewer frames where enough of them remain, and not more than arrive", () => {
    const { coded, part, maxRate_hz } = new Stream().runs(20, { ...CAMERA, link_bytes_s: 7e6 });
    expect({ coded, part }).toEqual({ coded: false, part: false });
    expect(maxRate_hz).toBeGreaterThan(4);
    expect(maxRate_hz).toBeLessThan(10);
  });

  test("is smaller frames, too, where those would be too few", () => {
    expect(new Stream().runs(20, { ...CAMERA, link_bytes_s: 4e6 })).toMatchObject({ coded: true, part: false });
    expect(new Stream().runs(40, { ...CAMERA, link_bytes_s: 1e6 })).toMatchObject({ coded: true, part: true });
  });

  test("is everything again once the link carries it", () => {
    const stream = new Stream();
    expect(stream.runs(40, { ...CAMERA, link_bytes_s: 1e6 })).not.toEqual(EVERYTHING);
    expect(stream.runs(90, { ...CAMERA, link_bytes_s: 20e6 })).toEqual(EVERYTHING);
  });

  test("is tried to be more ever more seldom over a link that stays thin", () => {
    const stream = new Stream();
    let [changes, before] = [[] as number[], stream.control.demand];
    while (stream.now_s < 400) {
      const now = stream.runs(1, { ...CAMERA, link_bytes_s: 7e6 });
      if (now !== before) changes = [...changes, stream.now_s];
      before = now;
    }
    const within = (from_s: number): number => changes.filter((at_s) => at_s >= from_s && at_s < from_s + 60).length;
    expect(within(340)).toBeLessThan(within(0));
  });

  test("stays everything where the page itself is slow, or the link is wide", () => {
    expect(new Stream().runs(30, { ...CAMERA, link_bytes_s: 100e6, draw_s: 0.4 })).toEqual(EVERYTHING);
    expect(new Stream().runs(30, { ...CAMERA, frame_bytes: 20e6, link_bytes_s: 60e6 })).toEqual(EVERYTHING);
  });

  test("is everything of another sequence", () => {
    const stream = new Stream();
    stream.runs(40, { ...CAMERA, link_bytes_s: 1e6 });
    stream.control.reset();
    expect(stream.control.demand).toEqual(EVERYTHING);
  });
});
