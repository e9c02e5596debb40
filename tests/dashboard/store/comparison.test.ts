import { signal } from "@preact/signals";
import { beforeEach, describe, expect, test, vi } from "vitest";

import { RequestError } from "../../../client/dashboard/src/store/api";
import { beyondShare, Comparison, differing, wiped } from "../../../client/dashboard/src/store/comparison";
import { type Frame, Frames, frameOf } from "../../../client/dashboard/src/store/frames";
import type { RangeErrors } from "../../../client/dashboard/src/store/rangeErrors";
import { Settings } from "../../../client/dashboard/src/store/settings";
import type { FrameMeta } from "../../../client/dashboard/src/stream/documents";
import { type FrameReport, summarised } from "../../../client/dashboard/src/stream/summary";

const report = (product: string, number: number, values: readonly number[], region = [0, 0, 3, 1]): FrameReport =>
  summarised({
    type: "frame",
    product,
    unit: "m",
    axes: ["y", "x"],
    meta: { frame: number, width: 3, height: 1, region, decimation: 1, base_frequency_hz: 23e6, exposure_s: 1e-3 },
    encode_s: 0,
    array: { dtype: "<f4", shape: [1, values.length], data: Float32Array.from(values) },
  } as unknown as Parameters<typeof summarised>[0]);

/** A page before a service whose frame n is n metres away in all pixels. */
class Page {
  readonly frames = new Frames();
  readonly errors = { range_error: signal<Frame | null>(null), trust: signal<Frame | null>(null) };
  readonly asked: string[] = [];
  refusal: RequestError | null = null;
  readonly settings = new Settings(null);
  readonly comparison: Comparison;
  readonly release: () => void;

  constructor() {
    const errors = { of: (product: keyof Page["errors"]) => this.errors[product] } as unknown as RangeErrors;
    this.comparison = new Comparison(this.frames, errors, this.settings);
    this.comparison.loader = async (path, products) => {
      this.asked.push(`${path} ${products.join()}`);
      if (this.refusal !== null) throw this.refusal;
      const number = Number(/frames\/(\d+)/.exec(path)?.[1]);
      return products.map((product) =>
        report(product, number, { range_error: [3, 3, 3], trust: [0, 0, 5] }[product] ?? [number, number, number]),
      );
    };
    this.release = this.frames.claim(["range"]);
    this.show(9, [10, 4, 8]);
  }

  show(number: number, values: readonly number[]): void {
    this.frames.put(frameOf(report("range", number, values)));
  }

  get shown(): Frame {
    return this.frames.of("range").peek() as Frame;
  }

  difference(): readonly number[] {
    return [...(this.comparison.of("range").difference.value?.values ?? [])];
  }
}

/** All that was begun is done: every answer is there already. */
const settled = (): Promise<void> => new Promise((done) => setTimeout(done));

/** What the browser keeps. */
const KEPT = new Map<string, unknown>();
vi.mock("idb-keyval", () => ({
  keys: async () => [...KEPT.keys()],
  get: async (name: string) => KEPT.get(name),
  set: async (name: string, value: unknown) => {
    if (name === "too large") throw new DOMException("no room");
    KEPT.set(name, value);
  },
  del: async (name: string) => KEPT.delete(name),
}));

let page: Page;
beforeEach(() => {
  KEPT.clear();
  page = new Page();
});

describe("a frame of a recording as B", () => {
  test("is brought as the service computes now, its errors last, and taken from A", async () => {
    page.comparison.source.value = { of: "rec", frame: 5 };
    await settled();
    const path = "/recordings/rec/frames/5?reconstruction=current";
    expect(page.asked).toEqual([`${path} range`, `${path} range_error,trust`]);
    expect(page.difference()).toEqual([5, -1, 3]);
    page.show(10, [5, 5, NaN]);
    expect(page.difference()).toEqual([0, 0, NaN]);
  });

  test("is not asked for maps that no view shows", async () => {
    page.release();
    page.comparison.source.value = { of: "rec", frame: 5 };
    await settled();
    expect(page.asked[0]).toBe("/recordings/rec/frames/5?reconstruction=current ");
  });

  test("gives way to the one that was chosen meanwhile", async () => {
    page.comparison.source.value = { of: "rec", frame: 5 };
    page.comparison.source.value = { of: "rec", frame: 6 };
    page.comparison.source.value = { of: "rec", frame: 7 };
    await settled();
    expect(page.comparison.of("range").b.value?.meta.frame).toBe(7);
    expect(page.asked.filter((each) => each.endsWith("trust"))).toHaveLength(1);
  });

  test("that cannot be had says why, and leaves no other in its place", async () => {
    page.comparison.source.value = { of: "rec", frame: 5 };
    await settled();
    page.refusal = new RequestError({ title: "It was deleted." });
    page.comparison.source.value = { of: "rec", frame: 6 };
    await settled();
    expect(page.comparison.trouble.value).toBe("It was deleted.");
    expect(page.comparison.of("range").b.value).toBeNull();
  });

  test("has no difference from a picture of another size", async () => {
    page.show(9, [1, 2]);
    page.comparison.source.value = { of: "rec", frame: 5 };
    await settled();
    expect(page.comparison.of("range").b.value).not.toBeNull();
    expect(page.comparison.of("range").difference.value).toBeNull();
  });

  test("is what a link says, and nothing else is", () => {
    page.settings.follow("#b=20261120T081500Z-3f9c2a.12&way=wipe");
    expect(page.comparison.source.value).toEqual({ of: "20261120T081500Z-3f9c2a", frame: 12 });
    expect(page.settings.hash(true)).toBe("#b=20261120T081500Z-3f9c2a.12&way=wipe");
    for (const link of ["#b=../camera.1", "#b=rec", "#b=rec.-1", "#way=sideways"]) page.settings.follow(link);
    expect(page.comparison.source.value).toEqual({ of: "20261120T081500Z-3f9c2a", frame: 12 });
    expect(page.comparison.ways.map.value).toBe("wipe");
  });
});

describe("a frame that is kept", () => {
  test("has all maps of the frame on screen, by its number", async () => {
    await page.comparison.keep(page.shown, "before");
    await settled();
    expect(page.asked[0]).toBe("/frames/9 range,direct,indirect,brightness,validity,range_error,trust");
    await page.comparison.look();
    expect(page.comparison.kept.value).toEqual(["before"]);
    expect(page.difference()).toEqual([1, -5, -1]); // from 9 m, as the service has it
    expect(page.settings.hash(true)).not.toContain("before");
  });

  test("is not kept where the service has it no more", async () => {
    page.refusal = new RequestError({ title: "It is gone." });
    await expect(page.comparison.keep(page.shown, "held")).rejects.toThrow("It is gone.");
    expect(KEPT.size).toBe(0);
  });

  test("is refused in words where the browser has no room", async () => {
    await expect(page.comparison.keep(page.shown, "too large")).rejects.toThrow("This browser keeps no frames: Error: no room.");
    expect(page.comparison.source.value).toBeNull();
  });

  test("replaces the one under its name, and says so once it was removed elsewhere", async () => {
    await page.comparison.keep(page.shown, "same");
    await settled();
    page.show(20, [20, 20, 21]);
    await page.comparison.keep(page.shown, "same");
    await settled();
    expect(page.difference()).toEqual([0, 0, 1]);
    await page.comparison.look("same");
    page.comparison.recompute();
    await settled();
    expect(page.comparison.trouble.value).toBe("This browser keeps no frame “same”.");
    expect(page.comparison.kept.value).toEqual([]);
  });
});

describe("what a difference is worth", () => {
  test("is known once both errors are, where both ranges are trusted", async () => {
    page.comparison.source.value = { of: "rec", frame: 5 };
    await settled();
    expect(page.comparison.error_m.value).toBeNull();
    page.errors.range_error.value = frameOf(report("range_error", 9, [4, 4, 4]));
    page.errors.trust.value = frameOf(report("trust", 9, [0, 7, 0]));
    expect([...(page.comparison.error_m.value ?? [])]).toEqual([5, NaN, NaN]); // 3, 4, 5; A and B not trusted
  });

  test("is the share of the pixels with an error that differ by more", () => {
    const difference = { values: Float32Array.from([2, -2, 0.5, 9, NaN]) } as unknown as Frame;
    expect(beyondShare(difference, Float32Array.from([1, 1, 1, NaN, 1]))).toBeCloseTo(2 / 3);
  });

  test("is doubted in words where the two were not measured alike", () => {
    const meta = { exposure_s: 1e-3, harmonics: 4, estimator: "likelihood", frame: 1 } as FrameMeta;
    expect(differing(meta, { ...meta, frame: 7 })).toEqual([]);
    expect(differing(meta, { ...meta, exposure_s: 2e-3, estimator: "pisarenko" })).toEqual(["exposure", "estimator"]);
  });
});

test("a wipe has A left of its line and B right of it, in each row", () => {
  const frame = (values: readonly number[]): Frame =>
    ({ product: "range", shape: [2, 4], values: Float32Array.from(values) }) as unknown as Frame;
  const [a, b] = [frame([1, 2, 3, 4, 5, 6, 7, 8]), frame([0, 0, 0, 0, 0, 0, 0, 0])];
  expect([...wiped(a, b, 2).values]).toEqual([1, 2, 0, 0, 5, 6, 0, 0]);
  expect([...wiped(a, b, 0).values]).toEqual([...b.values]);
  expect([...wiped(a, b, 4).values]).toEqual([...a.values]);
});
