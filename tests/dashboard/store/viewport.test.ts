import { describe, expect, test } from "vitest";

import { Settings } from "../../../client/dashboard/src/store/settings";
import { placeIn, seenAt, Viewport, WHOLE } from "../../../client/dashboard/src/store/viewport";

describe("the part of the picture that is shown", () => {
  test("grows around the pointer: what lies there stays there", () => {
    const viewport = new Viewport(new Settings(null));
    for (const [at, factor] of [
      [{ x: 0.8, y: 0.3 }, 3],
      [{ x: 0.1, y: 0.9 }, 1.7],
      [{ x: 0.5, y: 0.5 }, 0.6],
    ] as const) {
      const before = placeIn(viewport.view.value, at);
      viewport.zoomAt(at, factor);
      const seen = seenAt(viewport.view.value, before);
      expect(seen.x).toBeCloseTo(at.x, 9);
      expect(seen.y).toBeCloseTo(at.y, 9);
    }
  });

  test("never shows what lies beside the picture, and the whole picture at most", () => {
    const viewport = new Viewport(new Settings(null));
    viewport.zoomAt({ x: 0, y: 0 }, 4);
    viewport.pan({ x: 9, y: 9 });
    expect(viewport.view.value).toEqual({ zoom: 4, left: 0, top: 0 });
    viewport.pan({ x: -9, y: -9 });
    expect(viewport.view.value).toEqual({ zoom: 4, left: 0.75, top: 0.75 });
    viewport.zoomAt({ x: 0.5, y: 0.5 }, 0.01);
    expect(viewport.view.value).toBe(WHOLE);
  });

  test("moves with the pointer, and is whole again when it is reset", () => {
    const viewport = new Viewport(new Settings(null));
    viewport.zoomAt({ x: 0.5, y: 0.5 }, 2);
    const under = placeIn(viewport.view.value, { x: 0.4, y: 0.4 });
    viewport.pan({ x: 0.1, y: -0.1 });
    expect(seenAt(viewport.view.value, under).x).toBeCloseTo(0.5, 9);
    expect(seenAt(viewport.view.value, under).y).toBeCloseTo(0.3, 9);
    viewport.reset();
    expect(viewport.view.value).toBe(WHOLE);
  });
});
