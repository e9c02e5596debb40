import { expect, test } from "vitest";

import { EVERYTHING } from "../../src/stream/demand";
import { sequenceProblem } from "../../src/views/sequence/words";
import { demandWords } from "../../src/views/status/words";

const plain = (text: string): string => text.replaceAll("\u202f", " ");

test("a limit is said in the form's names and units", () => {
  const limit = "at most 1.875e+07 Hz: 8 harmonics have to stay below 1.5e+08 Hz";
  expect(plain(sequenceProblem({ field: "base_frequency_hz", limit }))).toBe(
    "Base frequency must be at most 18.75 MHz: 8 harmonics have to stay below 150 MHz.",
  );
  expect(plain(sequenceProblem({ field: "body.exposure_s", limit: "from 2e-05 to 0.05 s" }))).toBe("Exposure must be from 20 µs to 50 ms.");
});

test("a problem of another kind keeps its own words", () => {
  expect(sequenceProblem({ detail: "The camera is lost.", title: "Camera lost" })).toBe("The camera is lost.");
  expect(sequenceProblem({ field: "harmonics", title: "Invalid sequence" })).toBe("Invalid sequence");
});

test("what is asked for over a thin link, or by a slow browser, is said with its reason", () => {
  const slow = demandWords({ demand: { ...EVERYTHING, maxRate_hz: 8 }, carried_bytes_s: null, pictures_hz: 19.4 }, false);
  expect(plain(slow.short)).toBe("Slow browser: 8.0 Hz");
  expect(plain(slow.long)).toMatch(/^Before, this browser drew 19 pictures of the light a second.* asks for at most 8.0 Hz, and for more/);
  const both = demandWords({ demand: { maxRate_hz: 3, coded: true, part: true }, carried_bytes_s: 2e6, pictures_hz: 19.4 }, true);
  expect(plain(both.short)).toBe("Thin link: 3.0 Hz, 16 bits, the part in sight");
  expect(plain(both.long)).toMatch(/carried 2.00 MB\/s.* drew 19 pictures.* numbers in 16 bits, the part in sight only/);
});
