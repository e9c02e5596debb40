import { describe, expect, test } from "vitest";

import type { SequenceDocument } from "../../../client/dashboard/src/stream/documents";
import { documentOf, draftOf, missingOf } from "../../../client/dashboard/src/views/sequence/draft";

const SEQUENCE: SequenceDocument = {
  base_frequency_hz: 23e6,
  harmonics: 3,
  zeroth: "low-frequency",
  exposure_s: 0.00192,
  takes: 1,
  take_order: "sequential",
  sub_phases: { scheme: "arccos", n: 8 },
  sampling: null,
};

describe("a sequence being typed", () => {
  test("shows the units people use", () => expect(draftOf(SEQUENCE)).toMatchObject({ base_frequency_hz: "23", exposure_s: "1.92" }));

  test("comes back as the document it was made from, with what is not edited, but for the camera's own sampling", () => {
    for (const take_order of ["sequential", "interleaved"] as const) {
      const { sampling: _, ...whole } = { ...SEQUENCE, take_order };
      expect(documentOf(draftOf({ ...SEQUENCE, take_order }), SEQUENCE)).toEqual(whole);
    }
  });

  test("is no document while a field is empty or no number", () => {
    for (const harmonics of ["", "  ", "three", "1e999"]) {
      expect(documentOf({ ...draftOf(SEQUENCE), harmonics }, SEQUENCE)).toBeNull();
      expect(missingOf({ ...draftOf(SEQUENCE), harmonics })).toBe("harmonics");
    }
  });

  test("is read with a decimal comma", () =>
    expect(documentOf({ ...draftOf(SEQUENCE), base_frequency_hz: "12,5" }, SEQUENCE)?.base_frequency_hz).toBe(12.5e6));
});
