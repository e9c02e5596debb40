import { signal } from "@preact/signals";
import { expect, test } from "vitest";

import { RequestError } from "../../../client/dashboard/src/store/api";
import { Events } from "../../../client/dashboard/src/store/events";
import { Sequencing } from "../../../client/dashboard/src/store/sequencing";
import type { AppliedDocument, ChoiceDocument, ReconstructionDocument } from "../../../client/dashboard/src/stream/documents";
import { answering } from "../answering";

const sequence = (harmonics: number, sequence_id: number): AppliedDocument =>
  ({ base_frequency_hz: 23e6, harmonics, exposure_s: 1e-3, images: 4 * harmonics, sequence_id }) as AppliedDocument;
const choice = (harmonics: number, estimator: string): ChoiceDocument =>
  ({ sequence: sequence(harmonics, 0), estimator }) as unknown as ChoiceDocument;

/** A service that sets what it is sent, unless it refuses. */
function service() {
  const state = { estimator: "automatic", smoothing_px: 2, refusal: null as RequestError | null, sets: 0 };
  const current = signal<AppliedDocument | null>(sequence(3, 1));
  const set = ({ harmonics }: AppliedDocument): AppliedDocument => {
    if (state.refusal !== null) throw state.refusal;
    state.sets += 1;
    return sequence(harmonics, 1 + state.sets);
  };
  const reconstruction = () => ({ reconstruction_id: 1, estimator: state.estimator, smoothing_px: state.smoothing_px });
  const api = answering(
    { "PUT /sequence": ({ body }) => set(body) },
    {
      reconstruction: async () => ({ document: reconstruction() as ReconstructionDocument, tag: "t" }),
      setReconstruction: async (settings, tag) => {
        expect(tag).toBe("t");
        expect(settings).not.toHaveProperty("reconstruction_id");
        return Object.assign(state, settings) as unknown as ReconstructionDocument;
      },
    },
  );
  const events = new Events(() => 5);
  return { state, current, events, sequencing: new Sequencing(api, events, current) };
}

test("a change is shown with the way back, and undone by it", async () => {
  const { current, events, sequencing } = service();
  expect(sequencing.undoable.value).toBe(false);
  await sequencing.set(sequence(4, 0));
  expect(current.value?.harmonics).toBe(4);
  expect(events.all.value).toHaveLength(1);
  expect(events.all.value[0].remedy?.word).toBe("Undo");
  await sequencing.undo();
  expect(current.value?.harmonics).toBe(3);
  events.all.value[0].remedy?.run(); // of a change that another followed
  await Promise.resolve();
  expect(current.value?.harmonics).toBe(3);
  expect(events.all.value.at(-1)?.words).toContain("nothing was undone");
  await sequencing.undo(); // undoing is a change as well
  expect(current.value?.harmonics).toBe(4);
});

test("a choice takes the range from what it was predicted for, and undoing that too", async () => {
  const { state, sequencing } = service();
  await sequencing.apply(choice(6, "likelihood"));
  expect(state.estimator).toBe("automatic");
  await sequencing.apply(choice(2, "maximum-entropy"));
  expect([state.estimator, state.smoothing_px]).toEqual(["maximum-entropy", 2]);
  await sequencing.undo();
  expect(state.estimator).toBe("automatic");
});

test("what another client set since is not undone", async () => {
  const { current, events, sequencing } = service();
  await sequencing.set(sequence(4, 0));
  current.value = sequence(8, 99);
  expect(sequencing.undoable.value).toBe(false);
  await sequencing.undo();
  expect(current.value.harmonics).toBe(8);
  expect(events.all.value.at(-1)?.words).toContain("nothing was undone");
});

test("a refusal leaves everything as it was", async () => {
  const { state, current, events, sequencing } = service();
  await sequencing.set(sequence(4, 0));
  state.refusal = new RequestError({ title: "Ben controls the camera." });
  await expect(sequencing.set(sequence(5, 0))).rejects.toThrow("Ben");
  expect(current.value?.harmonics).toBe(4);
  await sequencing.undo();
  expect(events.all.value.at(-1)).toMatchObject({ words: "Ben controls the camera.", tone: "bad" });
  expect(sequencing.undoable.value).toBe(true);
});
