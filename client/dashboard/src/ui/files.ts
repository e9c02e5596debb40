/** Files of the service, to the browser's downloads. */
import type { Api } from "../store/api";
import { save } from "./download";

/**
 * Hands a file of the service to the browser's downloads, under the name that the service gives it, else under `name`.
 *
 * Without a token the browser fetches it by itself, with its own progress; with one it cannot show the token, so the
 * page fetches the file into what the browser keeps beside its memory. Raises RequestError then.
 */
export async function download(api: Api, path: string, name: string): Promise<void> {
  if (api.credentials.token.peek() !== null) {
    const file = await api.file(path);
    save(file.name || name, file);
    return;
  }
  const link = document.createElement("a");
  link.href = `api/v1${path}`;
  link.download = name;
  link.click();
}
