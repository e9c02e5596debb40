import { describe, expect, test } from "vitest";

import { npy, tableText } from "../../../client/dashboard/src/ui/download";

describe("an NPY file", () => {
  test.each([
    [new Float32Array([1.5, -2, 3, 4, 5, 6]), [2, 3], "<f4", "(2, 3)"],
    [new Uint8Array([1, 2]), [2], "|u1", "(2,)"],
    [new Float64Array([7]), [1, 1, 1], "<f8", "(1, 1, 1)"],
  ])("holds header and data of %o", (values, shape, descr, tuple) => {
    const bytes = npy(values, shape);
    const length = bytes[8] + 256 * bytes[9];
    const header = new TextDecoder().decode(bytes.slice(10, 10 + length));
    expect([...bytes.slice(0, 8)]).toEqual([0x93, 78, 85, 77, 80, 89, 1, 0]);
    expect((10 + length) % 64).toBe(0);
    expect(header).toContain(`'descr': '${descr}'`);
    expect(header).toContain(`'shape': ${tuple}`);
    expect(header.endsWith("\n")).toBe(true);
    expect([...bytes.slice(10 + length)]).toEqual([...new Uint8Array(values.buffer)]);
  });

  test("of a view holds what the view shows", () => {
    const all = new Float32Array([1, 2, 3, 4]);
    const bytes = npy(all.subarray(1, 3), [2]);
    expect([...new Float32Array(bytes.slice(-8).buffer)]).toEqual([2, 3]);
  });
});

test("a table has names with units, a line for each row, and nothing where there is no number", () => {
  const rows = [
    ["harmonics", "range_std_m", "within_share"],
    [3, 0.001, null],
    [4, 0.0005, Number.NaN],
  ];
  expect(tableText(rows)).toBe("harmonics,range_std_m,within_share\n3,0.001,\n4,0.0005,\n");
});
