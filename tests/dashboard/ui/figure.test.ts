import { describe, expect, test } from "vitest";

import type { FrameMeta } from "../../../client/dashboard/src/stream/documents";
import { captionOf, type Figure, figureLayout, figureSvg } from "../../../client/dashboard/src/ui/figure";

const FIGURE: Figure = {
  picture: "data:image/png;base64,AA",
  columns: 163,
  rows: 120,
  title: "Range & <b>",
  caption: "m = 3",
  scale: { low: 1, high: 3, kind: "linear" },
  colours: "viridis",
  unit: "m",
  ground: "white",
};

/** Texts of an SVG by their words, with the place of the mark before them where there is one. */
const marks = (svg: string): Map<string, [number, number]> =>
  new Map(
    [...svg.matchAll(/<path d="M([\d.]+) ([\d.]+)l[^>]*><text[^>]*>([^<]*)</g)].map(([, x, y, words]) => [words, [Number(x), Number(y)]]),
  );

describe("a figure", () => {
  const layout = figureLayout(163, 120, 640);
  const svg = figureSvg(FIGURE, layout);

  test("shows every pixel as a square of whole size", () => expect([layout.pictureWidth, layout.pictureHeight]).toEqual([652, 480]));

  test("marks pixels at their middles and values where their colours are", () => {
    const found = marks(svg);
    expect(found.get("150")?.[0]).toBeCloseTo(layout.left + (150.5 / 163) * 652, 9);
    // 2 m is half of the way from 1 m to 3 m
    expect(found.get("2.0")?.[1] ?? found.get("2")?.[1]).toBeCloseTo(layout.top + 240, 9);
    expect(svg).toContain('<stop offset="0" stop-color="rgb(68,1,84)"/>');
    expect(svg).toContain('<stop offset="1" stop-color="rgb(253,231,37)"/>');
  });

  test("marks times downwards from the first edge to the last", () => {
    const timed = figureSvg({ ...FIGURE, sides: 40 }, layout);
    const found = marks(timed);
    expect(found.get("0")).toBeDefined();
    expect(found.get("30")?.[1]).toBeCloseTo(layout.top + 0.75 * 480, 9);
    expect(timed).toContain(">time of flight (ns)<");
  });

  test("has neither rows nor columns of a view in space, and no bar of colours that stand for nothing", () => {
    const space = figureSvg({ ...FIGURE, sides: "space", scale: null }, layout);
    expect(marks(space).size).toBe(0);
    expect(space).not.toContain("(pixels)");
    expect(space).not.toContain("<linearGradient");
  });

  test("has its words as text, whatever stands in them", () => {
    expect(svg).toContain("Range &amp; &lt;b>");
    expect(svg).toContain(">m = 3<");
    expect(figureSvg({ ...FIGURE, picture: null }, layout)).not.toContain("<image");
  });
});

test("a caption says what was measured with, and which pixels were", () => {
  const meta = {
    harmonics: 3,
    base_frequency_hz: 23e6,
    zeroth: "low-frequency",
    exposure_s: 1.92e-3,
    takes: 2,
    estimator: "pisarenko",
    calibration_id: "nominal",
    frame: 7,
    width: 163,
    height: 120,
    region: [0, 0, 163, 120],
    decimation: 1,
  } as unknown as FrameMeta;
  const words = (changed: Partial<FrameMeta>): string => captionOf({ ...meta, ...changed }, null).replaceAll("\u202f", " ");
  const all = "m = 3, 23.00 MHz, b₀ low-frequency, 1.92 ms × 2; pisarenko; calibration nominal; frame 7";
  expect(words({})).toBe(all);
  expect(words({ decimation: 2 })).toBe(`${all}, every 2nd pixel`);
  expect(words({ region: [40, 30, 20, 10] })).toBe(`${all}, what was in sight`);
});
