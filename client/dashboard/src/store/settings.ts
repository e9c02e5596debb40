import { effect, type Signal, signal } from "@preact/signals";

/** Where settings outlive the page; a browser may refuse it (private windows, policies). */
export interface Shelf {
  getItem(key: string): string | null;
  setItem(key: string, value: string): void;
}

const PREFIX = "transientcam.";

/** A signal whose value is remembered; what is remembered counts only if `accepts` takes it. */
export function remembered<T>(shelf: Shelf | null, key: string, initial: T, accepts: (value: unknown) => value is T): Signal<T> {
  const value = signal(initial);
  try {
    const text = shelf?.getItem(PREFIX + key) ?? null;
    const stored: unknown = text === null ? undefined : JSON.parse(text);
    if (accepts(stored)) value.value = stored;
  } catch {
    // What cannot be read is not remembered.
  }
  effect(() => {
    const text = JSON.stringify(value.value);
    try {
      shelf?.setItem(PREFIX + key, text);
    } catch {
      // A full or refused store loses the setting, nothing else.
    }
  });
  return value;
}

/** Accepts one of the given values. */
export function oneOf<T>(values: readonly T[]): (value: unknown) => value is T {
  return (value): value is T => values.includes(value as T);
}

export function aNumber(value: unknown): value is number {
  return typeof value === "number" && Number.isFinite(value);
}

export function aBoolean(value: unknown): value is boolean {
  return typeof value === "boolean";
}

/** The browser's own shelf, or null where it is refused. */
export function browserShelf(): Shelf | null {
  try {
    return window.localStorage;
  } catch {
    return null;
  }
}

/** The shelf of this tab, which is emptied when it is closed; null where it is refused. */
export function sessionShelf(): Shelf | null {
  try {
    return window.sessionStorage;
  } catch {
    return null;
  }
}
