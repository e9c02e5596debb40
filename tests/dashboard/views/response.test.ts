import { describe, expect, test } from "vitest";

import type { PixelDocument } from "../../../client/dashboard/src/stream/documents";
import { FlagHistory } from "../../../client/dashboard/src/views/response/flagShares";
import { richestPixel } from "../../../client/dashboard/src/views/response/interesting";
import { LOOKS } from "../../../client/dashboard/src/views/response/looks";
import { linesOf, ReturnHistory, sifted } from "../../../client/dashboard/src/views/response/returns";
import { stemsOf } from "../../../client/dashboard/src/views/response/stems";
import { momentsOf, picture } from "../oracle";

const look = (frame: number, flags: readonly string[], x = 4): PixelDocument =>
  ({ x, y: 5, flags, meta: { frame, sequence_id: 1 } }) as unknown as PixelDocument;

describe("flags of a pixel", () => {
  test("that come and go are shown by their share, and do not flicker", () => {
    const history = new FlagHistory();
    for (let frame = 0; frame < 10; frame++) history.take(look(frame, frame % 2 === 0 ? ["biased"] : []));
    expect(history.shares()).toEqual([{ name: "biased", share: 0.5 }]);
    expect(history.looks).toBe(10);
  });

  test("count once a frame, for the last looks only, and for one pixel", () => {
    const history = new FlagHistory();
    for (let n = 0; n < 5; n++) history.take(look(1, ["saturated"]));
    expect(history.looks).toBe(1);
    for (let frame = 2; frame < LOOKS + 2; frame++) history.take(look(frame, []));
    expect([history.looks, history.shares()]).toEqual([LOOKS, []]);
    history.take(look(99, ["biased"], 7));
    expect([history.looks, history.shares()]).toEqual([1, [{ name: "biased", share: 1 }]]);
  });
});

describe("returns of a pixel", () => {
  test("with hardly any light are summed up", () => {
    const returns = [3, 1160, 400, 11].map((weight, n) => ({ time_s: n * 1e-9, weight }));
    const { strong, weak, weakShare } = sifted(returns);
    expect(strong.map(({ weight }) => weight)).toEqual([1160, 400]);
    expect(weak).toBe(2);
    expect(weakShare).toBeCloseTo(14 / 1574, 12);
  });

  test("are all listed where there are few, and none where there is none", () => {
    expect(sifted([{ time_s: 0, weight: 5 }]).strong).toHaveLength(1);
    expect(sifted([])).toEqual({ strong: [], weak: 0, weakShare: 0 });
  });
});

const at = (time_ns: number, weight = 100) => ({ time_s: time_ns * 1e-9, weight });

describe("returns beside the true ones", () => {
  test("stand with the one that is the nearest to them, and the other way round", () => {
    const [found, truth] = [
      [at(10.1), at(20)],
      [at(10), at(20.3), at(28)],
    ];
    expect(linesOf(found, truth)).toEqual([
      { found: found[0], truth: truth[0] },
      { found: found[1], truth: truth[1] },
      { found: null, truth: truth[2] },
    ]);
  });

  test("of which two are near the same true one share it not", () => {
    const [found, truth] = [[at(10), at(12)], [at(10.4)]];
    expect(linesOf(found, truth).map((line) => line.truth)).toEqual([truth[0], null]);
    expect(linesOf(found, []).map((line) => line.truth)).toEqual([null, null]);
  });

  test("scatter as they did in the looks before, of the same pixel", () => {
    const history = new ReturnHistory();
    const taken = (frame: number, time_ns: number, x = 4): void =>
      history.take({ ...look(frame, [], x), returns: [at(time_ns, 100 + frame), at(30)] });
    for (const [frame, time_ns] of [9.9, 10.1, 9.9, 10.1].entries()) taken(frame, time_ns);
    expect(history.of(at(10)).time_s).toBeNaN();
    taken(4, 10);
    // by hand: squares of 0.1 four times over five less one
    expect(history.of(at(10)).time_s).toBeCloseTo(0.1e-9, 15);
    expect(history.of(at(10)).weight).toBeCloseTo(Math.sqrt(2.5), 9);
    expect(history.of(at(15)).time_s).toBeNaN();
    taken(5, 10, 7);
    expect(history.of(at(10)).time_s).toBeNaN();
  });
});

const scene = (width: number, height: number, twice: (x: number, y: number) => boolean) => {
  const two = momentsOf(
    [
      { phase_rad: 1, weight: 500 },
      { phase_rad: 3.5, weight: 400 },
    ],
    20,
    4,
  );
  const one = momentsOf([{ phase_rad: 2, weight: 900 }], 20, 4);
  return picture(
    Array.from({ length: width * height }, (_, at) => (twice(at % width, Math.floor(at / width)) ? two : one)),
    width,
  );
};

describe("the pixel that is shown first", () => {
  test("is one with several returns, not one with one", () => {
    const [width, height] = [32, 20];
    const c = scene(width, height, (x, y) => x >= 20 && x < 24 && y >= 8 && y < 12);
    const found = richestPixel(c);
    expect(found?.x).toBeGreaterThanOrEqual(20);
    expect(found?.x).toBeLessThan(24);
    expect(found?.y).toBeGreaterThanOrEqual(8);
  });

  test("is none where no pixel has a density", () => {
    const c = scene(16, 10, () => false);
    expect(richestPixel({ ...c, planes: c.planes.map(() => 0) })).toBeNull();
  });
});

describe("stems of returns", () => {
  test("stand as high as their share of the light, the found ones with the scatter of their time", () => {
    const history = new ReturnHistory();
    for (let frame = 0; frame < 10; frame++) {
      history.take({ x: 1, y: 2, returns: [at(frame % 2 === 0 ? 10 : 11, 300), at(30, 100)], meta: { frame } } as unknown as PixelDocument);
    }
    const { found, truth } = stemsOf(
      { returns: [at(10.5, 300), at(30, 100)] },
      { kind: "paths", range_m: 1.5, direct_share: 1, direct: 100, brightness: 400, returns: [at(10, 100)] },
      history,
    );
    expect(found.map(({ share }) => share)).toEqual([0.75, 0.25]);
    expect(found[0].std_s).toBeCloseTo(Math.sqrt(10 / 9) * 0.5e-9, 15);
    expect(found[1].std_s).toBeCloseTo(0, 15);
    expect(truth).toEqual([{ time_s: 10e-9, std_s: NaN, share: 0.25 }]);
  });

  test("of weak returns are left out, as in the table", () =>
    expect(stemsOf({ returns: [at(10, 990), at(20, 10)] }, null, new ReturnHistory()).found).toHaveLength(1));
});
