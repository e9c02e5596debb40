import { type ReadonlySignal, signal } from "@preact/signals";
import { useMemo } from "preact/hooks";

import { refusalIn } from "../store/api";

/** Something a control asks of the service: one at a time, with what came of it in words. */
export interface Task {
  /** What is being done, in words; null while nothing is. */
  readonly busy: ReadonlySignal<string | null>;
  /** Why the last one was refused, in words; null if it was not. */
  readonly refusal: ReadonlySignal<string | null>;
  /** Does it unless something is being done; true once it is done, false if it was refused. */
  readonly run: (words: string, work: () => Promise<unknown>) => Promise<boolean>;
  readonly dismiss: () => void;
}

function makeTask(): Task {
  const busy = signal<string | null>(null);
  const refusal = signal<string | null>(null);
  const run = async (words: string, work: () => Promise<unknown>): Promise<boolean> => {
    if (busy.peek() !== null) return false;
    busy.value = words;
    refusal.value = null;
    try {
      await work();
      return true;
    } catch (error) {
      refusal.value = refusalIn(error).message;
      return false;
    } finally {
      busy.value = null;
    }
  };
  return { busy, refusal, run, dismiss: () => (refusal.value = null) };
}

export function useTask(): Task {
  return useMemo(makeTask, []);
}
