import { describe, expect, test } from "vitest";

import { annotationsOf, limitsOf, linesOf } from "../../../client/dashboard/src/views/recordings/typed";
import { duration } from "../../../client/dashboard/src/views/replay/words";

describe("limits of a recording", () => {
  test("are what is typed, in the service's units", () => {
    expect(limitsOf({ duration_s: " 30 ", size_mb: "1.5", frames: "100" })).toEqual({ duration_s: 30, max_bytes: 1_500_000, frames: 100 });
    expect(limitsOf({ duration_s: "", size_mb: " ", frames: "" })).toEqual({});
  });

  test.each([
    { duration_s: "0", size_mb: "", frames: "" },
    { duration_s: "-1", size_mb: "", frames: "" },
    { duration_s: "", size_mb: "much", frames: "" },
    { duration_s: "", size_mb: "", frames: "1.5" },
    { duration_s: "Infinity", size_mb: "", frames: "" },
  ])("that are none are refused: %o", (typed) => expect(limitsOf(typed)).toBeNull());
});

describe("annotations as lines", () => {
  test("come back as they were, whatever they hold", () => {
    const annotations = { sample: "corner", exposure: 3, list: [1, { a: null }], text: "3", yes: true, quoted: '"x"' };
    expect(annotationsOf(linesOf(annotations))).toEqual(annotations);
  });

  test("leave out lines that say nothing, and need a name each", () => {
    expect(
      annotationsOf([
        { name: "a", text: "b" },
        { name: "", text: " " },
      ]),
    ).toEqual({ a: "b" });
    expect(annotationsOf([{ name: "", text: "b" }])).toBeNull();
    expect(
      annotationsOf([
        { name: "a", text: "b" },
        { name: " a ", text: "c" },
      ]),
    ).toBeNull();
  });
});

test("durations are written as people do", () => {
  expect([0, 4.24, 59.94, 59.96, 65, 3723].map(duration)).toEqual([
    "0.0\u202fs",
    "4.2\u202fs",
    "59.9\u202fs",
    "1:00\u202fmin",
    "1:05\u202fmin",
    "1:02:03\u202fh",
  ]);
});
