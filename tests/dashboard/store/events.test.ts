import { describe, expect, test } from "vitest";

import { Events, inWords, lossWords } from "../../../client/dashboard/src/store/events";
import type { AppliedDocument } from "../../../client/dashboard/src/stream/documents";
import type { Notice } from "../../../client/dashboard/src/stream/protocol";

const words = (notice: Record<string, unknown>): string | undefined => inWords({ type: "notice", ...notice } as unknown as Notice)?.words;

describe("what happened", () => {
  test("is kept in order, but not for ever", () => {
    const events = new Events(() => 5);
    for (let n = 0; n < 250; n++) events.tell(`event ${n}`);
    expect(events.all.value).toHaveLength(100);
    expect(events.all.value.at(-1)).toEqual({ number: 250, at_s: 5, words: "event 249", tone: "plain" });
  });

  test("is shown once where the service and this page both tell of it, with what can be done", () => {
    let now_s = 5;
    const events = new Events(() => now_s);
    const remedy = { word: "Undo", run: () => undefined };
    events.tell("It changed.", "plain", { key: "sequence-2" });
    events.tell("It changed.", "good", { key: "sequence-2", remedy });
    events.tell("It changed.", "plain", { key: "sequence-2" });
    expect(events.all.value).toEqual([{ number: 1, at_s: 5, words: "It changed.", tone: "plain", key: "sequence-2", remedy }]);
    now_s = 500; // a service that was started anew counts from the start
    events.tell("It changed.", "plain", { key: "sequence-2" });
    expect(events.all.value).toHaveLength(2);
  });

  test("to the sequence is said with its figures", () => {
    const sequence = { base_frequency_hz: 23e6, harmonics: 4, exposure_s: 5e-4, images: 20 } as AppliedDocument;
    expect(words({ kind: "sequence-changed", sequence })).toBe("The sequence changed: 23.0\u202fMHz, m = 4, 500\u202fµs, 20 images.");
  });

  test("to the light is said before it goes on, and when it is off", () => {
    expect(words({ kind: "light-arming", in_s: 3 })).toBe("The camera's light goes on in 3.0\u202fs.");
    expect(words({ kind: "light-off", because: "stop", reason: "the capture was stopped" })).toBe(
      "The light is off: the capture was stopped.",
    );
  });

  test("to control is said with the names", () => {
    expect(words({ kind: "lease-changed", change: "taken-over", holder: "B", from: "A" })).toBe("B has taken over control from A.");
    expect(words({ kind: "lease-changed", change: "lapsed", holder: "A" })).toContain("lapsed");
  });

  test("to the calibration is said with its reason", () => {
    expect(words({ kind: "calibration-changed", calibration_id: "nominal", reason: "It has 3 harmonics." })).toBe(
      "Nominal gains are used from now on. It has 3 harmonics.",
    );
    expect(words({ kind: "calibration-changed", calibration_id: "c1", reason: null })).toContain("c1");
  });

  test("to a recording is said with why it ended", () =>
    expect(words({ kind: "recording-stopped", recording: "r", reason: "disk-space", problem: null })).toBe(
      "The recording ended because the disk is nearly full.",
    ));

  test("is not said of drops, which have their figure, nor of kinds this page does not know", () => {
    expect(words({ kind: "dropped", channel: 0, count: 1, total: 1 })).toBeUndefined();
    expect(words({ kind: "eclipse" })).toBeUndefined();
  });
});

describe("images that were lost", () => {
  test("are shown once a burst, with how many there were", () => {
    let now_s = 100;
    const events = new Events(() => now_s);
    events.tally("lost-images", 3, lossWords, "plain");
    now_s += 5;
    events.tell("something else");
    events.tally("lost-images", 2, lossWords, "plain");
    expect(events.all.value.map((happening) => happening.words)).toEqual([lossWords(5), "something else"]);
    expect(lossWords(5)).toMatch(/^5 images did not arrive intact/);
    now_s += 60;
    events.tally("lost-images", 1, lossWords, "plain");
    expect(events.all.value.at(-1)?.words).toMatch(/^1 image did/);
    expect(events.all.value).toHaveLength(3);
  });
});

test("a lost camera is shown once, although its reason says so too", () => {
  const reason = "the camera was lost: HEARTBEAT: No such device";
  expect(words({ kind: "camera-lost", reason })).toBe("The camera was lost: HEARTBEAT: No such device");
  expect(words({ kind: "camera-lost", reason: "pulled" })).toBe("The camera was lost: pulled");
});
