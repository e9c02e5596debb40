import { describe, expect, test } from "vitest";

import { Api } from "../../../client/dashboard/src/store/api";
import { Store } from "../../../client/dashboard/src/store/store";
import type { CameraDocument, RecordingDocument } from "../../../client/dashboard/src/stream/documents";
import { type OpenedFile, openFile, recordingIn } from "../../../client/dashboard/src/views/files/openFile";

const file = (name: string, text = ""): OpenedFile => Object.assign(new Blob([text]), { name });
const recording = (id: string, size_bytes: number): RecordingDocument => ({ id, size_bytes }) as RecordingDocument;

describe("the recording of a file", () => {
  const all = [
    recording("20261120T081500Z-3f9c2a", 10),
    recording("20261120T081500Z-aaaaaa", 20),
    recording("20261121T000000Z-bbbbbb", 20),
  ];

  test("is that of its name, also of a second download", () =>
    expect(recordingIn(all, file("door-20261120T081500Z-aaaaaa (1).h5"))?.id).toBe("20261120T081500Z-aaaaaa"));

  test("is that of its size where the file has another name, unless two are as large", () => {
    expect(recordingIn(all, { name: "mine.h5", size: 10 })?.id).toBe("20261120T081500Z-3f9c2a");
    expect(recordingIn(all, { name: "mine.h5", size: 20 })).toBeNull();
    expect(recordingIn(all, { name: "mine.h5", size: 3 })).toBeNull();
  });
});

describe("a file that is given to the page", () => {
  const said = (store: Store): string => store.events.all.value.at(-1)?.words ?? "";
  const asked: string[] = [];
  const store = (simulated: boolean): Store => {
    asked.length = 0;
    const made = new Store({
      shelf: null,
      api: new Api((address, init) => {
        asked.push(`${init?.method ?? "GET"} ${address as string}`);
        return Promise.resolve(new Response(JSON.stringify({ recordings: [] })));
      }),
    });
    made.camera.value = { state: "streaming", reason: null, simulated, capabilities: {} } as CameraDocument;
    return made;
  };

  test("of another kind is refused in words", async () => {
    const page = store(true);
    await openFile(page, file("cat.png"));
    expect(said(page)).toContain("cat.png is none of what this page opens");
  });

  test("is put before a simulated camera, and not before a real one", async () => {
    const page = store(true);
    await openFile(page, file("own.toml", "name = 'own'"));
    expect(asked).toContain("PUT api/v1/simulation");
    expect(said(page)).toContain("before the scene of own.toml");
    const real = store(false);
    await openFile(real, file("own.toml", "name = 'own'"));
    expect(asked).toEqual([]);
    expect(said(real)).toContain("this is a real one");
  });

  test("that is too long for a scene is not sent", async () => {
    const page = store(true);
    await openFile(page, file("own.toml", "#".repeat(65_537)));
    expect(asked).toEqual([]);
    expect(said(page)).toContain("longer than 65536 characters");
  });

  test("of a recording that the service does not have says what to do", async () => {
    const page = store(true);
    await openFile(page, file("other.h5"));
    expect(said(page)).toContain("transientcam replay");
  });
});
