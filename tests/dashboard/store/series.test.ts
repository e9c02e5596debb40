import { expect, test } from "vitest";

import { csvOf } from "../../../client/dashboard/src/store/series";

test("a table has names with units, a line for each row, and nothing where there is no number", () => {
  const rows = [
    { harmonics: 3, range_std_m: 0.001, within_share: null },
    { harmonics: 4, range_std_m: 0.0005, within_share: 1 },
  ];

  expect(csvOf(rows)).toBe("harmonics,range_std_m,within_share\r\n3,0.001,\r\n4,0.0005,1\r\n");
});
