import { describe, expect, test } from "vitest";

import { Api } from "../../../client/dashboard/src/store/api";
import { Store } from "../../../client/dashboard/src/store/store";
import type { CameraDocument } from "../../../client/dashboard/src/stream/documents";
import { type OpenedFile, openFile } from "../../../client/dashboard/src/views/files/openFile";

const file = (name: string, text = ""): OpenedFile => Object.assign(new Blob([text]), { name });
const ID = "20261120T081500Z-3f9c2a";

describe("a file that is given to the page", () => {
  const said = (store: Store): string => store.events.all.value.at(-1)?.words ?? "";
  const asked: string[] = [];
  const fetched: typeof fetch = (address, init) => {
    asked.push(`${init?.method ?? "GET"} ${address as string}`);
    return Promise.resolve(new Response(JSON.stringify(answers)));
  };
  const answers: unknown = {
    recordings: [{ id: ID, name: "door" }],
    limits: { max_upload_bytes: 10 },
    id: "taken-in",
    name: "theirs",
  };
  const store = (simulated: boolean, fetching: (share: (sent: number) => void) => typeof fetch = () => fetched): Store => {
    asked.length = 0;
    const made = new Store({ shelf: null, api: new Api(fetched, undefined, fetching) });
    made.replay.open = (id) => Promise.resolve(void asked.push(`replay ${id}`));
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

  test("of a recording that the service has is shown from there, by the name of its download", async () => {
    const page = store(true);
    await openFile(page, file(`door-${ID} (1).h5`, "x".repeat(99)));
    expect(asked).toEqual([`GET api/v1/recordings?limit=1000&search=${ID}`, `replay ${ID}`]);
  });

  test("of a recording that the service does not have is sent, which is told, and then shown", async () => {
    const shares: (number | undefined)[] = [];
    const page = store(true, (onSent) => (address, init) => {
      shares.push(page.recordings.sending.value?.share);
      onSent(0.5);
      shares.push(page.recordings.sending.value?.share);
      return fetched(address, init);
    });
    await openFile(page, file("other.h5", "HDF5"));
    expect(asked).toContain("POST api/v1/recordings/import");
    expect(asked.at(-1)).toBe("replay taken-in");
    expect([...shares, page.recordings.sending.value]).toEqual([0, 0.5, null]);
    expect(said(page)).toBe("theirs is one of the service's recordings now.");
  });

  test("of a recording is not sent on where that is cancelled", async () => {
    const page = store(true, () => (_, init) => {
      const aborted = new Promise<Response>((_, reject) =>
        init?.signal?.addEventListener("abort", () => reject(new DOMException("", "AbortError"))),
      );
      page.recordings.sending.value?.cancel();
      return aborted;
    });
    await openFile(page, file("other.h5", "HDF5"));
    expect(said(page)).toBe("other.h5 was not sent: you cancelled it.");
    expect(page.recordings.sending.value).toBeNull();
  });

  test("of a recording that is larger than the service takes says what to do", async () => {
    const page = store(true);
    await openFile(page, file("other.h5", "12345678901"));
    expect(said(page)).toMatch(/other\.h5 has 11.0\sB, and 10.0\sB may be sent.*transientcam replay/u);
    expect(asked).toEqual(["GET api/v1/recordings?limit=1000&search="]);
  });
});
