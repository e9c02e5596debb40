import { expect, test } from "vitest";

import { sequenceProblem } from "../../src/views/sequence/words";

const plain = (text: string): string => text.replaceAll("\u202f", " ");

test("a limit is said in the form's names and units", () => {
  const limit = "at most 1.875e+07 Hz: 8 harmonics have to stay below 1.5e+08 Hz";
  expect(plain(sequenceProblem({ field: "base_frequency_hz", limit }))).toBe(
    "Base frequency must be at most 18.75 MHz: 8 harmonics have to stay below 150 MHz.",
  );
  expect(plain(sequenceProblem({ field: "body.exposure_s", limit: "from 2e-05 to 0.05 s" }))).toBe(
    "Exposure must be from 20 µs to 50 ms.",
  );
});

test("a problem of another kind keeps its own words", () => {
  expect(sequenceProblem({ detail: "The camera is lost.", title: "Camera lost" })).toBe("The camera is lost.");
  expect(sequenceProblem({ field: "harmonics", title: "Invalid sequence" })).toBe("Invalid sequence");
});
