import { describe, expect, test } from "vitest";

import { layersOf, packTexels } from "../../../client/dashboard/src/gl/texels";

describe("texels", () => {
  test.each([
    [1, 1],
    [2, 2],
    [3, 2],
    [4, 3],
    [8, 5],
  ])("of %i harmonics need %i layers", (harmonics, layers) => expect(layersOf(harmonics)).toBe(layers));

  test("hold two complex numbers each, with E in the place of a_0", () => {
    // Planes [E, Re a_1, Im a_1, Re a_2, Im a_2] of two pixels.
    const planes = Float32Array.from([100, 200, 11, 21, 12, 22, 13, 23, 14, 24]);
    const texels = new Float32Array(16);
    packTexels({ planes, harmonics: 2, width: 2, height: 1, baseFrequency_hz: 1 }, texels);
    expect([...texels]).toEqual([100, 0, 11, 12, 200, 0, 21, 22, 13, 14, 0, 0, 23, 24, 0, 0]);
  });
});
