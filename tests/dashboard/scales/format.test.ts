import { expect, test } from "vitest";

import { engineering, fixed, grouped, numberOf, significant, superscript } from "../../../client/dashboard/src/scales/format";

const plain = (text: string): string => text.replaceAll("\u202f", " ");

test("what is missing is a dash, never a number", () => {
  expect([fixed(NaN, 2, "m"), fixed(null, 2), engineering(undefined, "s"), significant(Infinity, 3)]).toEqual(Array(4).fill("–"));
});

test("units get the prefix that keeps a number short", () => {
  expect(plain(engineering(0.0904, "s"))).toBe("90.4 ms");
  expect(plain(engineering(23e6, "Hz", 4))).toBe("23.00 MHz");
  expect(plain(engineering(6_630_000, "B/s"))).toBe("6.63 MB/s");
  expect(plain(engineering(0, "s"))).toBe("0 s");
  expect(plain(engineering(999.9999, "s"))).toBe("1.00 ks");
});

test("significant digits stay as many as asked for", () => {
  expect(plain(significant(1234.5, 3, "DN/ns"))).toBe("1235 DN/ns");
  expect(significant(0.01234, 3)).toBe("0.0123");
  expect(significant(3.2e-7, 2)).toBe("3.2·10⁻⁷");
});

test("thousands stand apart, and a minus is a minus", () => {
  expect(plain(grouped(1234567))).toBe("1 234 567");
  expect(grouped(0)).toBe("0");
  expect(fixed(-1.5, 1)).toBe("−1.5");
  expect(superscript(-12)).toBe("⁻¹²");
});

test("a typed number has a decimal point or comma", () => {
  expect(["12.5", " 12,5 ", "1e-3", "-3"].map(numberOf)).toEqual([12.5, 12.5, 1e-3, -3]);
  for (const text of ["", " ", "1,234.5", "1,2,3", "three"]) expect(numberOf(text)).toBeNaN();
});
