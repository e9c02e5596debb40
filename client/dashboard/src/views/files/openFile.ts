/** Files that a user gives to the page: a scene, a recording, a calibration. */
import { engineering } from "../../scales/format";
import { RequestError } from "../../store/api";
import type { Store } from "../../store/store";

/** Characters of a scene that the service takes. */
const LONGEST_SCENE = 65_536;

/** What of a File is used. */
export type OpenedFile = Blob & Readonly<{ name: string }>;

/** Opens a file by what it is, and says what came of it. */
export async function openFile(store: Store, file: OpenedFile): Promise<void> {
  const opener = OPENERS[file.name.slice(file.name.lastIndexOf(".")).toLowerCase()];
  await store.events.reported(async () => {
    if (opener === undefined)
      throw new RequestError({
        detail: `${file.name} is none of what this page opens: a scene (.toml), a recording (.h5) or a calibration (.npz).`,
      });
    store.events.tell(await opener(store, file), "good");
  });
}

/** Each does it and answers what was done, or raises RequestError. */
const OPENERS: Readonly<Record<string, (store: Store, file: OpenedFile) => Promise<string>>> = {
  ".toml": async (store, file) => {
    if (store.camera.peek()?.simulated !== true)
      throw new RequestError({ detail: "A scene is for a simulated camera, and this is a real one." });
    if (store.obstacle.peek() !== null) throw new RequestError({ detail: `The scene was not changed: ${store.obstacle.peek()}` });
    const text = file.size > 4 * LONGEST_SCENE ? null : await file.text();
    if (text === null || text.length > LONGEST_SCENE)
      throw new RequestError({ detail: `${file.name} is longer than ${LONGEST_SCENE} characters, the most of a scene.` });
    await store.simulation.set({ definition: text });
    return `The camera stands before the scene of ${file.name}.`;
  },
  ".h5": async (store, file) => {
    const [id = ""] = /\d{8}T\d{6}Z-[0-9a-f]+/.exec(file.name) ?? [];
    const listed = await store.api.ask("GET /recordings", { at: `/recordings?limit=1000&search=${id}` });
    // a download is named by its id
    const found = id === "" ? undefined : listed.recordings.find((recording) => recording.id === id);
    const { max_upload_bytes } = listed.limits;
    if (found === undefined && file.size > max_upload_bytes)
      throw new RequestError({
        detail: `${file.name} has ${engineering(file.size, "B")}, and ${engineering(max_upload_bytes, "B")} may be sent. Put it into the directory of the recordings, or open it with "transientcam replay".`,
      });
    const shown = found ?? (await store.recordings.send(file));
    await store.replay.open(shown.id);
    store.replay.toggle();
    return `${shown.name} is ${found === undefined ? "one of the service's recordings now" : "shown from the service's recordings"}.`;
  },
  ".npz": async (store, file) => {
    await store.calibrations.take(file);
    return `The calibration ${file.name} was taken in; it can be used now.`;
  },
};

/** Lets the user choose a file, by default of any kind that can be opened, and opens it, or has it taken otherwise. */
export function chooseFile(
  store: Store,
  kind = Object.keys(OPENERS).join(),
  take = (file: File): void => void openFile(store, file),
): void {
  const input = document.createElement("input");
  input.type = "file";
  input.accept = kind;
  input.onchange = () => {
    const file = input.files?.[0];
    if (file !== undefined) take(file);
  };
  input.click();
}
