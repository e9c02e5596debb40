import { describe, expect, test } from "vitest";

import { type Demand, DemandControl, EVERYTHING } from "../../../client/dashboard/src/stream/demand";

interface Way {
  readonly camera_hz: number;
  /** Bytes of a whole frame, and bytes a second that the link carries. */
  readonly frame_bytes: number;
  readonly link_bytes_s: number;
  /** How long the service takes for a frame, however large it is sent. */
  readonly serve_s?: number;
  /** How long the page takes for a whole frame, and for a picture of the light; without the latter none moves. */
  readonly frame_s?: number;
  readonly picture_s?: number | undefined;
  readonly display_hz?: number;
}

/**
 * A service that sends the newest frame of those that are due as soon as the link is free, and counts the rest; a page of one
 * processor, which what it takes for frames leaves for pictures. Times pass as the frames say.
 */
class Stream {
  readonly control = new DemandControl();
  /** When something else was asked for, and what. */
  readonly changes: { readonly at_s: number; readonly demand: Demand }[] = [];
  now_s = 0;
  pictures_hz = 0;
  #free_s = 0;
  #due_s = 0;
  #frame = 0;
  #counted_s = 0;
  #busy_s = 0;

  runs(span_s: number, { camera_hz, frame_bytes, link_bytes_s, serve_s = 0, frame_s = 0.01, picture_s, display_hz = 60 }: Way): Demand {
    const end_s = this.now_s + span_s;
    let [lost, waits] = [0, false];
    for (; this.now_s < end_s; this.now_s += TICK_S) {
      if (picture_s !== undefined && this.now_s - this.#counted_s >= 2) {
        const left = 1 - this.#busy_s / (this.now_s - this.#counted_s);
        this.pictures_hz = Math.min(display_hz, Math.max(1, left / picture_s));
        this.control.pictured(this.pictures_hz);
        [this.#counted_s, this.#busy_s] = [this.now_s, 0];
      }
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
      const draw_s = frame_s / (part ? 4 : 1);
      const arrives_s = this.now_s + serve_s + bytes / link_bytes_s;
      this.#free_s = Math.max(arrives_s, this.now_s + draw_s);
      this.#busy_s += draw_s;
      if (lost > 0) this.control.dropped(0, lost);
      lost = 0;
      const changed = this.control.arrived(arrives_s, this.#frame, bytes);
      this.control.drewAll(arrives_s + draw_s);
      if (!changed) continue;
      this.changes.push({ at_s: this.now_s, demand: this.control.demand });
      this.control.restart();
      [this.#counted_s, this.#busy_s] = [this.now_s, 0];
    }
    return this.control.demand;
  }

  changesWithin(from_s: number, span_s: number): number {
    return this.changes.filter(({ at_s }) => at_s >= from_s && at_s < from_s + span_s).length;
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

describe("over a link", () => {
  test.each([undefined, 0.01])("that carries enough frames, everything is asked for", (picture_s) => {
    expect(new Stream().runs(60, { ...CAMERA, link_bytes_s: 20e6, picture_s })).toEqual(EVERYTHING);
    expect(new Stream().runs(60, { ...CAMERA, link_bytes_s: 7e6, picture_s })).toEqual(EVERYTHING);
  });

  test("that carries too few, smaller frames are asked for, and no fewer", () => {
    expect(new Stream().runs(20, { ...CAMERA, link_bytes_s: 4e6 })).toEqual({ coded: true, part: false, maxRate_hz: null });
    expect(new Stream().runs(60, { ...CAMERA, link_bytes_s: 1e6 })).toEqual({ coded: true, part: true, maxRate_hz: null });
  });

  test("that is thin, it is the link that is named although the page is slow too", () => {
    const stream = new Stream();
    stream.runs(12, { ...CAMERA, link_bytes_s: 4e5, picture_s: 0.05 });
    expect(stream.changes[0].demand).toEqual({ coded: true, part: false, maxRate_hz: null });
    expect(stream.control.decision).toMatchObject({ pictures_hz: null, carried_bytes_s: expect.closeTo(4e5, -5) as number });
  });

  test("that carries more again, everything is asked for again", () => {
    const stream = new Stream();
    expect(stream.runs(40, { ...CAMERA, link_bytes_s: 1e6 })).not.toEqual(EVERYTHING);
    expect(stream.runs(90, { ...CAMERA, link_bytes_s: 20e6 })).toEqual(EVERYTHING);
    expect(stream.control.decision).toMatchObject({ pictures_hz: null, carried_bytes_s: null });
  });

  test("that stays thin, more is tried ever more seldom", () => {
    const stream = new Stream();
    stream.runs(400, { ...CAMERA, link_bytes_s: 1e6 });
    expect(stream.changesWithin(300, 100)).toBeLessThan(stream.changesWithin(0, 100));
  });

  test("that is not what is slow, smaller frames are tried and given up", () => {
    // a service that takes 4 s for a frame of 640 x 480 pixels: 0.24 frames a second, whatever is asked for
    for (const picture_s of [undefined, 0.07]) {
      const stream = new Stream();
      expect(stream.runs(300, { camera_hz: 2, frame_bytes: 11e6, link_bytes_s: 35e6, serve_s: 3.9, picture_s })).toEqual(EVERYTHING);
      expect(stream.changesWithin(120, 180)).toBe(0);
    }
  });
});

/** Over a wide link. */
const LOCAL = { camera_hz: 18, frame_bytes: 1e6, link_bytes_s: 1e9 };
const FAST: Way = { ...LOCAL, frame_s: 0.005, picture_s: 0.01 };
/** Takes 18 frames and 10 pictures a second, or 30 pictures and 9 frames. */
const SLOW: Way = { ...LOCAL, frame_s: 0.045, picture_s: 0.02 };
/** Draws 20 pictures a second whatever frames it takes. */
const STARVED: Way = { ...LOCAL, frame_s: 0, picture_s: 0.05 };

describe("in a browser", () => {
  test("that moves light fluently, everything is asked for", () => {
    for (const way of [FAST, { ...FAST, display_hz: 30 }]) {
      const stream = new Stream();
      stream.runs(200, way);
      expect(stream.changes).toEqual([]);
    }
  });

  test("that is slow for a moment, too", () => {
    const stream = new Stream();
    for (const way of [SLOW, FAST, SLOW, FAST]) stream.runs(2.5, way);
    expect(stream.changes).toEqual([]);
  });

  test("that is slow by its frames, fewer are asked for, so that light flows within 10 s", () => {
    const stream = new Stream();
    expect(stream.runs(10, SLOW)).toMatchObject({ coded: false, part: false });
    expect(stream.control.demand.maxRate_hz).toBeCloseTo(9, 0);
    expect(stream.pictures_hz).toBeGreaterThanOrEqual(29);
    expect(stream.control.decision).toMatchObject({ carried_bytes_s: null, pictures_hz: expect.closeTo(9.5, 0) as number });
  });

  test("that takes no more than 5, parts of these are asked for, and all again once there is room", () => {
    const large: Way = { ...LOCAL, camera_hz: 12, frame_s: 0.12, picture_s: 0.022 };
    const stream = new Stream();
    stream.runs(20, large);
    const few = stream.changes.at(-1)?.demand;
    expect(few).toMatchObject({ part: true, maxRate_hz: expect.closeTo(5, 0) as number });
    stream.runs(400, large);
    expect(stream.changesWithin(300, 100)).toBeLessThanOrEqual(8); // tried, but seldom
    expect(stream.runs(100, FAST)).toEqual(EVERYTHING);
  });

  test("of a camera of few frames, half are taken at least", () =>
    expect(new Stream().runs(20, { ...LOCAL, camera_hz: 4, frame_s: 0.12, picture_s: 0.03 })).toMatchObject({
      maxRate_hz: expect.closeTo(2, 1) as number,
    }));

  test("in which fewer frames give no more pictures, everything is asked for until these are fewer by much", () => {
    const stream = new Stream();
    stream.runs(20, STARVED);
    expect(stream.changes).toHaveLength(2);
    expect(stream.runs(100, STARVED)).toEqual(EVERYTHING);
    expect(stream.changes).toHaveLength(2);
    stream.runs(8, { ...STARVED, picture_s: 0.1 });
    expect(stream.changes.slice(2)).toMatchObject([{ demand: { part: false } }, { demand: EVERYTHING }]);
  });
});

test("while light rests everything is asked for, and then less as before", () => {
  const stream = new Stream();
  const less = stream.runs(60, { ...CAMERA, link_bytes_s: 1e6 });
  stream.control.rest(true);
  expect(stream.control.demand).toEqual(EVERYTHING);
  expect(stream.runs(60, { ...CAMERA, link_bytes_s: 1e6 })).toEqual(EVERYTHING);
  stream.control.rest(false);
  expect(stream.control.demand).toEqual(less);
});

test("of another sequence everything is asked for", () => {
  const stream = new Stream();
  stream.runs(40, { ...CAMERA, link_bytes_s: 1e6 });
  stream.control.reset();
  expect(stream.control.demand).toEqual(EVERYTHING);
});
