import { effect } from "@preact/signals";

/** Waits until what is read from signals is there: resolves to the first answer that is not undefined. */
export function until<T>(read: () => T | undefined): Promise<T> {
  return new Promise((resolve) => {
    const end = effect(() => {
      const found = read();
      if (found === undefined) return;
      resolve(found);
      queueMicrotask(() => end());
    });
  });
}
