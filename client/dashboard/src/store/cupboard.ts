/** Frames that outlive the page, under names. */
import { RequestError } from "./api";
import type { Frame } from "./frames";

/** Where frames are kept; each method raises RequestError where the browser refuses or has no room. */
export interface Cupboard {
  names(): Promise<readonly string[]>;
  /** The products of a frame under a name; undefined where there is none. */
  get(name: string): Promise<readonly Frame[] | undefined>;
  put(name: string, frames: readonly Frame[]): Promise<unknown>;
  remove(name: string): Promise<unknown>;
}

const SHELF = "frames";

/** The browser's own, of this page's address. */
export function browserCupboard(): Cupboard {
  const inside = <T>(mode: IDBTransactionMode, ask: (shelf: IDBObjectStore) => IDBRequest<T>): Promise<T> =>
    new Promise((resolve, reject) => {
      const refuse = (error: DOMException | null): void =>
        reject(new RequestError({ title: `The browser keeps no frames: ${error?.message ?? "it gives no reason"}.` }));
      const opened = indexedDB.open("transientcam", 1);
      opened.onupgradeneeded = () => opened.result.createObjectStore(SHELF);
      opened.onerror = () => refuse(opened.error);
      opened.onsuccess = () => {
        const change = opened.result.transaction(SHELF, mode);
        const request = ask(change.objectStore(SHELF));
        change.oncomplete = () => resolve(request.result);
        change.onabort = () => refuse(change.error);
      };
    });
  return {
    names: async () => (await inside("readonly", (shelf) => shelf.getAllKeys())).map(String),
    get: (name) => inside("readonly", (shelf) => shelf.get(name) as IDBRequest<readonly Frame[] | undefined>),
    put: (name, frames) => inside("readwrite", (shelf) => shelf.put(frames, name)),
    remove: (name) => inside("readwrite", (shelf) => shelf.delete(name)),
  };
}
