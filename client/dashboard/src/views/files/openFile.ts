/** Files that a user gives to the page: a scene, a recording, a calibration. */
import { RequestError } from "../../store/api";
import type { Store } from "../../store/store";
import type { RecordingDocument } from "../../stream/documents";

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
    const found = recordingIn(listed.recordings, file);
    if (found === null)
      throw new RequestError({
        detail: `The service has no recording like ${file.name}. A page cannot bring one to it: put the file into the directory of the recordings, or open it with "transientcam replay".`,
      });
    await store.replay.open(found.id);
    store.replay.toggle();
    return `${found.name} is shown from the service's recordings.`;
  },
  ".npz": async (store, file) => {
    await store.calibrations.take(file);
    return `The calibration ${file.name} was taken in; it can be used now.`;
  },
};

/** The recording that a file is of: by the name it was downloaded under, else by its size, where no other is as large. */
export function recordingIn(
  recordings: readonly RecordingDocument[],
  { name, size }: Pick<OpenedFile, "name" | "size">,
): RecordingDocument | null {
  const named = recordings.find(({ id }) => name.includes(id));
  if (named !== undefined) return named;
  const alike = recordings.filter(({ size_bytes }) => size_bytes === size);
  return alike.length === 1 ? alike[0] : null;
}

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
