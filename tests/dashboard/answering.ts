import type { Api } from "../../client/dashboard/src/store/api";

/** What an operation is asked with, as far as tests read it. */
interface Details {
  readonly of: string;
  readonly at: string;
  // biome-ignore lint/suspicious/noExplicitAny: each operation has a body of its own
  readonly body: any;
}

/** A service that answers operations by their names, and has what is `more` besides; one that is not named fails the test. */
export function answering(answers: Readonly<Record<string, (details: Details) => unknown>>, more: Partial<Api> = {}): Api {
  return { ask: async (operation: string, details: Details) => answers[operation](details), ...more } as unknown as Api;
}
