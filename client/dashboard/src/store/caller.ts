import { computed, signal } from "@preact/signals";
import type { CallerDocument } from "../stream/documents";
import { type Api, RequestError } from "./api";

/** Who the service takes this page for, by its token. */
export class Caller {
  /** Null while that is not known. */
  readonly document = signal<CallerDocument | null>(null);
  /** Why this page may change nothing at all; null where it may. */
  readonly obstacle = computed(() => {
    const caller = this.document.value;
    return caller?.role === "viewer" ? `The token ${caller.name} is a viewer's` : null;
  });
  readonly #api: Api;

  constructor(api: Api) {
    this.#api = api;
  }

  /** Asks the service. */
  async look(): Promise<void> {
    try {
      this.document.value = await this.#api.caller();
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.document.value = null;
    }
  }
}
