import { describe, expect, it } from "vitest";

import type { EffectDocument, ExplanationDocument } from "../../../client/dashboard/src/stream/documents";
import { effectWords, ordered, possible, sizeShare, sizeWords } from "../../../client/dashboard/src/views/simulation/words";

const effect = (name: string, relative: number, built: boolean): EffectDocument => ({
  effect: name,
  what: "",
  choice: "auto",
  called_for: built,
  built,
  reason: "",
  relative,
  size_dn: 0,
  worst: 0,
  cost_s: 0,
});

describe("the table of effects", () => {
  it("shows what is computed first, and the largest of these before all", () => {
    const effects = [effect("small", 0.2, true), effect("absent", 0, false), effect("suppressed", 5, false), effect("large", 3, true)];
    const not_made = [{ ...effect("lacking", 6, false), called_for: true }, effect("tiny", 0.01, false)];
    const names = ordered({ effects, not_made } as unknown as ExplanationDocument).map((each) => each.effect);
    expect(names).toEqual(["large", "small", "lacking", "suppressed", "absent"]);
  });

  it("draws the threshold in the middle, two decades to either side, and nothing for nothing", () => {
    const shares = [0, 1e-5, 1e-3, 0.1, 1, 10, 1000].map((relative) => sizeShare(effect("any", relative, true), 0.1));
    const expected = [0, 0, 0, 0.5, 0.75, 1, 1];
    shares.forEach((share, n) => expect(share).toBeCloseTo(expected[n], 12));
  });

  it("says sizes as multiples of the noise floor", () => {
    expect(sizeWords(effect("any", 3.217, true))).toBe("3.2×");
    expect(sizeWords(effect("any", 0, false))).toBe("0");
  });

  it("names effects for people", () => expect(effectWords("fixed-pattern-phase")).toBe("Fixed pattern phase"));
});

describe("faults", () => {
  it("need a cable to happen on, and an end of it to plug in", () => {
    expect(possible("unplug", true)).toBe(true);
    expect(possible("unplug", false)).toBe(false);
    expect(possible("replug", true)).toBe(false);
    expect(possible("replug", false)).toBe(true);
    expect(possible("drop-image", false)).toBe(false);
  });
});
