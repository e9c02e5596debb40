import { describe, expect, test } from "vitest";

import { PaceControl } from "../../src/stream/pace";

/** A browser of one processor, which what it takes for frames leaves for pictures. */
interface Browser {
  readonly camera_hz: number;
  readonly frame_s: number;
  readonly picture_s: number;
  readonly display_hz?: number;
}

class Watched {
  readonly control = new PaceControl();
  /** What was asked for in each window. */
  readonly asked: (number | null)[] = [];
  readonly parts: boolean[] = [];
  pictures_hz = 0;

  plays(windows: number, { camera_hz, frame_s, picture_s, display_hz = 60 }: Browser): this {
    for (let n = 0; n < windows; n++) {
      const frames_hz = Math.min(camera_hz, this.control.maxRate_hz ?? Infinity);
      const taken_s = this.control.part ? frame_s / 4 : frame_s;
      this.pictures_hz = Math.min(display_hz, Math.max(1, (1 - frames_hz * taken_s) / picture_s));
      this.control.judge({ pictures_hz: this.pictures_hz, frames_hz, camera_hz });
      this.asked.push(this.control.maxRate_hz);
      this.parts.push(this.control.part);
    }
    return this;
  }

  /** Windows of the last so many after which something else was asked for. */
  changes(windows: number): number {
    const recent = this.asked.slice(-windows - 1);
    return recent.filter((rate_hz, at) => at > 0 && rate_hz !== recent[at - 1]).length;
  }
}

const FAST: Browser = { camera_hz: 18, frame_s: 0.005, picture_s: 0.01 };
/** Takes 18 frames and 10 pictures a second, or 30 pictures and 8 frames. */
const SLOW: Browser = { camera_hz: 18, frame_s: 0.045, picture_s: 0.02 };

describe("of the frames", () => {
  test("a browser that moves light fluently takes all", () => {
    expect(new Watched().plays(200, FAST).asked.every((rate_hz) => rate_hz === null)).toBe(true);
    expect(new Watched().plays(200, { ...FAST, display_hz: 30 }).asked.every((rate_hz) => rate_hz === null)).toBe(true);
  });

  test("one slow window costs none, two cost some", () => {
    const watched = new Watched().plays(1, SLOW);
    expect(watched.control.maxRate_hz).toBeNull();
    expect(watched.control.acts).toBe(true);
    watched.plays(1, FAST).plays(1, SLOW);
    expect(watched.control.maxRate_hz).toBeNull();
    watched.plays(1, SLOW);
    expect(watched.control.maxRate_hz).toBeLessThan(18);
  });

  test("a slow browser takes as many as leave 30 pictures a second, within 10 s, and no fewer than 5", () => {
    const watched = new Watched().plays(5, SLOW);
    expect(watched.control.maxRate_hz).toBeGreaterThanOrEqual(5);
    expect(watched.plays(1, SLOW).pictures_hz).toBeGreaterThanOrEqual(29);
    const slower = new Watched().plays(20, { ...SLOW, picture_s: 0.03 });
    expect(slower.control.maxRate_hz).toBe(5);
    expect(slower.control.acts).toBe(false); // it has done all that it can
  });

  test("parts are taken where 5 whole ones are too many, and whole ones again once there is room", () => {
    const watched = new Watched().plays(5, SLOW);
    expect(watched.parts.includes(true)).toBe(false); // fewer will do
    const large: Browser = { camera_hz: 12, frame_s: 0.12, picture_s: 0.022 };
    const slow = new Watched().plays(6, large);
    expect([slow.control.part, slow.control.maxRate_hz]).toEqual([true, 5]);
    expect(slow.plays(1, large).pictures_hz).toBeGreaterThanOrEqual(29);
    slow.plays(300, large);
    expect(slow.changes(30)).toBeLessThanOrEqual(4); // tried, but seldom
    slow.plays(100, FAST);
    expect([slow.control.part, slow.control.maxRate_hz]).toEqual([false, null]);
  });

  test("a browser that takes hardly 5 of all is asked to take some fewer", () => {
    const control = new PaceControl();
    for (let n = 0; n < 8; n++) control.judge({ pictures_hz: n < 2 ? 10 : 20, frames_hz: 4, camera_hz: 18 });
    expect(control.maxRate_hz).toBeCloseTo(2.8, 6);
  });

  test("a camera's that are few already, half are taken at least", () =>
    expect(new Watched().plays(20, { camera_hz: 4, frame_s: 0.1, picture_s: 0.03 }).control.maxRate_hz).toBe(2));

  test("all are taken again once there is room", () => {
    const watched = new Watched().plays(10, SLOW);
    expect(watched.control.maxRate_hz).not.toBeNull();
    expect(watched.plays(20, FAST).control.maxRate_hz).toBeNull();
    expect(new Watched().plays(10, SLOW).plays(20, { ...FAST, display_hz: 30 }).control.maxRate_hz).toBeNull();
  });

  test("more are tried ever more seldom where they are too many", () => {
    // With fewer frames there seems to be room, as the pictures are drawn on another processor.
    const edge: Browser = { camera_hz: 18, frame_s: 0.045, picture_s: 0.012 };
    const watched = new Watched().plays(30, edge);
    const early = watched.changes(30);
    watched.plays(300, edge);
    expect(watched.changes(30)).toBeLessThan(early);
    expect(watched.changes(30)).toBeLessThanOrEqual(4); // half a minute apart, there and back
  });

  test("all are taken where fewer give no more pictures, until these are fewer by much", () => {
    const starved: Browser = { camera_hz: 18, frame_s: 0, picture_s: 0.05 };
    const watched = new Watched().plays(20, starved);
    expect(Math.min(...watched.asked.map((rate_hz) => rate_hz ?? Infinity))).toBe(5);
    expect([watched.control.part, watched.control.maxRate_hz]).toEqual([false, null]);
    watched.plays(100, starved);
    expect(watched.changes(100)).toBe(0);
    watched.plays(4, { ...starved, picture_s: 0.1 });
    expect(watched.control.maxRate_hz).not.toBeNull();
  });

  test("none are missed where none come", () => {
    const control = new PaceControl();
    for (let n = 0; n < 10; n++) expect(control.judge({ pictures_hz: 3, frames_hz: 0, camera_hz: 0 })).toBe(false);
    expect(control.maxRate_hz).toBeNull();
  });
});
