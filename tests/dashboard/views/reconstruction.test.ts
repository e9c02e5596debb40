import { describe, expect, test } from "vitest";

import type { ParameterDocument } from "../../../client/dashboard/src/stream/documents";
import { draftOf, labelOf, readingOf, spanOf, unitOf } from "../../../client/dashboard/src/views/reconstruction/fields";

const parameter = (name: string, value: unknown, more: Partial<ParameterDocument> = {}): ParameterDocument => ({
  name,
  resource: "/api/v1/reconstruction",
  pointer: `/${name}`,
  value,
  type: "number",
  unit: null,
  min: null,
  max: null,
  allowed: null,
  access: "read-write",
  description: "",
  ...more,
});

const PARAMETERS = [
  parameter("smoothing_px", 0.6, { unit: "px", min: 0, max: 10 }),
  parameter("estimator", "pisarenko", { type: "string", allowed: ["pisarenko", "maximum-entropy"] }),
  parameter("rounds", 3, { type: "integer", min: 1 }),
  parameter("careful", true, { type: "boolean" }),
];

describe("a form made of parameters", () => {
  test("untouched stands for what is set", () => {
    expect(readingOf(PARAMETERS, draftOf(PARAMETERS))).toEqual({
      settings: { smoothing_px: 0.6, estimator: "pisarenko", rounds: 3, careful: true },
    });
  });

  test("takes numbers and choices as they are typed", () => {
    const draft = { smoothing_px: " 1.5 ", estimator: "maximum-entropy", rounds: "4", careful: "false" };
    expect(readingOf(PARAMETERS, draft)).toEqual({
      settings: { smoothing_px: 1.5, estimator: "maximum-entropy", rounds: 4, careful: false },
    });
  });

  test.each([
    ["smoothing_px", "11", "Smoothing must be a number from 0 to 10\u202fpx."],
    ["smoothing_px", "", "Smoothing must be a number from 0 to 10\u202fpx."],
    ["rounds", "1.5", "Rounds must be an integer at least 1."],
  ])("says what is wrong: %s = %s", (name, text, words) =>
    expect(readingOf(PARAMETERS, { ...draftOf(PARAMETERS), [name]: text })).toEqual({ wrong: name, words }),
  );

  test("names and measures what it does not know, too", () => {
    expect(labelOf("inner_radius_px")).toBe("Inner radius");
    expect(unitOf(parameter("x", 0, { unit: "dn" }))).toBe("DN");
    expect(spanOf(parameter("x", 0, { max: 0.25 }))).toBe("at most 0.25");
    expect(spanOf(parameter("x", 0, { min: 0, max: 0.99 }))).toBe("from 0 to 0.99");
  });
});
