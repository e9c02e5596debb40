import { describe, expect, test } from "vitest";

import { LightPainter } from "../../../client/dashboard/src/gl/paintLight";
import type { Backdrop } from "../../../client/dashboard/src/gl/renderer";
import { densityAt } from "../../../client/dashboard/src/physics/maximumEntropy";
import { colourTable, levelOf } from "../../../client/dashboard/src/scales/colourMaps";
import { backdropGrey, strength, TONES, toned } from "../../../client/dashboard/src/scales/tone";
import { momentsOf, picture } from "../oracle";

const PIXELS = 60;
const PHASE_RAD = 1.3;
/** Light that arrives between before and long after the time of the picture; one pixel has none. */
const LIGHT = picture(Array.from({ length: PIXELS }, (_, n) => momentsOf([{ phase_rad: 1 + n / 20, weight: 100 }], 10, 4)));
LIGHT.planes[7] = NaN;
const SCENE: Backdrop = { values: Float32Array.from({ length: PIXELS }, (_, n) => (n === 3 ? NaN : 7 * n)), white: 250 };

/** Light over what the still scene leaves of white, channel by channel. */
function expected(pixel: number, white: number, kind: (typeof TONES)[number], backdrop: Backdrop | null): number[] {
  const share = densityAt(LIGHT, pixel, PHASE_RAD) / white;
  const place = share >= 0 ? toned(kind, share) : 0;
  const grey = backdrop === null ? 0 : backdropGrey(backdrop.values[pixel] / backdrop.white);
  const added = backdrop === null ? 1 : strength(place);
  return [0, 1, 2].map((channel) => 255 * (1 - (1 - grey) * (1 - (added * colourTable("inferno")[4 * levelOf(place) + channel]) / 255)));
}

describe("painted light", () => {
  test.each(TONES)("has the colours of its density in the %s tone, before the scene and alone", (kind) => {
    const painter = new LightPainter();
    const white = densityAt(LIGHT, 6, PHASE_RAD) / 2; // some are as bright as can be
    for (const backdrop of [SCENE, null, { ...SCENE, white: 100 }]) {
      const rgba = new Uint8Array(4 * PIXELS);
      painter.paint(LIGHT, { phase_rad: PHASE_RAD, tone: { kind, white }, colours: "inferno", backdrop }, new Uint32Array(rgba.buffer));
      for (let pixel = 0; pixel < PIXELS; pixel++) {
        expect(rgba[4 * pixel + 3]).toBe(255);
        expected(pixel, white, kind, backdrop).forEach((value, channel) =>
          expect(Math.abs(rgba[4 * pixel + channel] - value)).toBeLessThan(0.51),
        );
      }
    }
  });
});
