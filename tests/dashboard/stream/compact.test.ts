import { describe, expect, test } from "vitest";

import { pixelOf } from "../../../client/dashboard/src/physics/reflection";
import { codesFor, decodeReflection16, has, spread, whole } from "../../../client/dashboard/src/stream/compact";

/** Codes of u = (2 / pi) arcsin|g| g / |g|, as docs/stream.md has them. */
function codesOf(reflection: readonly (readonly [number, number])[], at: number, area: number, codes: Uint16Array): void {
  reflection.forEach(([re, im], k) => {
    const size = Math.hypot(re, im);
    const scale = size === 0 ? 0 : ((2 / Math.PI) * Math.asin(size)) / size;
    codes[2 * k * area + at] = Math.round(32768 + 32767 * scale * re);
    codes[(2 * k + 1) * area + at] = Math.round(32768 + 32767 * scale * im);
  });
}

describe("coefficients in codes", () => {
  test("have the brightness and the reflection coefficients that were coded", () => {
    const pixels = [
      {
        light: 1200,
        reflection: [
          [0.5, -0.3],
          [-0.2, 0.7],
          [0.1, 0.05],
          [0, -0.6],
        ],
      },
      {
        light: 3,
        reflection: [
          [-0.98, 0.1],
          [0, 0],
          [0.3, 0.3],
          [0.7, 0.7],
        ],
      },
    ] as const;
    const codes = new Uint16Array(8 * pixels.length);
    pixels.forEach(({ reflection }, at) => codesOf(reflection, at, pixels.length, codes));
    const planes = decodeReflection16(
      codes,
      Float32Array.from(pixels, ({ light }) => light),
    );
    const c = { planes, harmonics: 4, width: 2, height: 1, baseFrequency_hz: 23e6 };
    pixels.forEach(({ light, reflection }, at) => {
      const found = pixelOf(c, at);
      expect(found?.moments[0]).toBeCloseTo(light, 2);
      reflection.flat().forEach((part, n) => expect(found?.reflection[n]).toBeCloseTo(part, 3));
    });
  });

  test("are for images of numbers and for coefficients, and for nothing else", () => {
    expect(codesFor(["y", "x"], "<f4")).toBe("u16");
    expect(codesFor(["y", "x"], "|u1")).toBeNull();
    expect(codesFor(["coefficient", "y", "x"], "<f4")).toBe("reflection16");
    expect(codesFor(["harmonic", "y", "x"], "<c8")).toBeNull();
  });
});

describe("part of a picture", () => {
  test("gives planes that are drawn the pixel of those that were left out, also at the ends", () => {
    const codes = Float32Array.from([1, 2, 3, 4, 5, 6, 7, 8]); // two planes of 2 x 2
    const [one, other] = [
      [1, 1, 2, 1, 1, 2, 3, 3, 4],
      [5, 5, 6, 5, 5, 6, 7, 7, 8],
    ];
    expect([...whole(codes, [2, 2, 2], { region: [0, 0, 3, 3], decimation: 2 }, 3, 3)]).toEqual([...one, ...other]);
  });

  test("gives a map no value where none was sent, and is drawn without gaps", () => {
    const cut = { region: [1, 0, 3, 3], decimation: 2 } as const;
    const map = whole(Float32Array.from([1, 2, 3, 4]), [2, 2], cut, 4, 4);
    expect([...map]).toEqual([NaN, 1, NaN, 2, NaN, NaN, NaN, NaN, NaN, 3, NaN, 4, NaN, NaN, NaN, NaN]);
    map.forEach((value, at) => expect(has(cut, at % 4, Math.floor(at / 4))).toBe(!Number.isNaN(value)));
    expect([...spread(map, cut, 4)]).toEqual([NaN, 1, 1, 2, NaN, 1, 1, 2, NaN, 3, 3, 4, NaN, NaN, NaN, NaN]);
  });

  test("fills each plane; flags outside of it are none", () => {
    const cut = { region: [1, 1, 2, 1], decimation: 1 } as const;
    expect([...whole(Uint8Array.from([7, 8, 9, 10]), [2, 1, 2], cut, 3, 2)]).toEqual([0, 0, 0, 0, 7, 8, 0, 0, 0, 0, 9, 10]);
  });
});
