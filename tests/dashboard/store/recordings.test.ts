import { expect, test } from "vitest";

import { PAGE, Recordings } from "../../../client/dashboard/src/store/recordings";
import type { RecordingDocument, RecordingsDocument } from "../../../client/dashboard/src/stream/documents";
import { answering } from "../answering";

/** A list whose answers the test gives, and what was asked. */
function listing(): {
  recordings: Recordings;
  asked: URLSearchParams[];
  answer: (at: number, found: Partial<RecordingsDocument>) => Promise<void>;
} {
  const asked: URLSearchParams[] = [];
  const waiting: ((found: RecordingsDocument) => void)[] = [];
  const api = answering({
    "GET /recordings": ({ at }) => {
      asked.push(new URLSearchParams(at.split("?")[1]));
      return new Promise((resolve) => waiting.push(resolve));
    },
    "GET /recordings/{recording}": ({ of }) => ({ id: of, state: "recording" }) as RecordingDocument,
  });
  const answer = async (at: number, found: Partial<RecordingsDocument>): Promise<void> => {
    waiting[at]({ active: null, recordings: [], ...found } as RecordingsDocument);
    await new Promise((resolve) => setTimeout(resolve));
  };
  return { recordings: new Recordings(api), asked, answer };
}

test("nothing is asked before the list is opened; then each change of what is looked for is", async () => {
  const { recordings, asked, answer } = listing();
  recordings.search.value = "corner";
  expect(asked).toHaveLength(0);
  void recordings.refresh();
  await answer(0, {});
  recordings.tag.value = "wet & far";
  expect(Object.fromEntries(asked[1])).toEqual({ search: "corner", sort: "-started_s", limit: `${PAGE}`, tag: "wet & far" });
});

test("an answer that is overtaken by a later one is left out", async () => {
  const { recordings, answer } = listing();
  void recordings.refresh();
  await answer(0, {});
  recordings.search.value = "a";
  recordings.search.value = "ab";
  await answer(2, { directory: "of ab" });
  await answer(1, { directory: "of a" });
  expect(recordings.document.value?.directory).toBe("of ab");
});

test("the one that runs is known though it is not among those looked for", async () => {
  const { recordings, answer } = listing();
  void recordings.refresh();
  await answer(0, { active: "r" });
  expect(recordings.active.value?.id).toBe("r");
});
