import { describe, expect, test } from "vitest";

import { densityImage } from "../../../client/dashboard/src/physics/densityImage";
import { densityOf, momentsOf, picture } from "../oracle";

const F_HZ = 23e6;
const GOOD = momentsOf(
  [
    { phase_rad: 1.1, weight: 700 },
    { phase_rad: 3.9, weight: 300 },
  ],
  60,
  3,
);

describe("the density of a whole picture", () => {
  test.each([1, 2, 3, 4, 8])("agrees in each pixel with a dense solve of its moment problem at m = %i", (m) => {
    // more pixels than are computed at a time, and not a multiple of them
    const pixels = Array.from({ length: 4099 }, (_, n) => momentsOf([{ phase_rad: 0.5 + n / 1000, weight: 100 + n }], 5, m));
    const image = new Float32Array(pixels.length);
    densityImage(picture(pixels, pixels.length), 2.5, image);
    pixels.forEach((b, pixel) => {
      const expected = 2 * Math.PI * F_HZ * densityOf(b, 2.5);
      expect(Math.abs(image[pixel] / expected - 1)).toBeLessThan(1e-3);
    });
  });

  test("has pixels without one, which spoil only themselves", () => {
    const c = picture([GOOD, GOOD, GOOD]);
    for (let plane = 0; plane < 7; plane++) c.planes[plane * 3 + 1] = NaN;
    const image = new Float32Array(3);
    densityImage(c, 1, image);
    expect(image[1]).toBeNaN();
    expect(image[0]).toBeGreaterThan(0);
    expect(image[2]).toBe(image[0]);
  });
});
