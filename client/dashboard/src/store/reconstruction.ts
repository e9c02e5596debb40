import { signal } from "@preact/signals";
import type { ParameterDocument, ReconstructionDocument } from "../stream/documents";
import { type Api, RequestError, type Tagged } from "./api";

/** How frames are computed, and what can be set of it within which limits. */
export class Reconstruction {
  /** Null before it was read. */
  readonly current = signal<Tagged<ReconstructionDocument> | null>(null);
  readonly parameters = signal<readonly ParameterDocument[]>([]);
  readonly trouble = signal<string | null>(null);
  readonly #api: Api;

  constructor(api: Api) {
    this.#api = api;
  }

  async refresh(): Promise<void> {
    try {
      const [current, { parameters }] = await Promise.all([this.#api.reconstruction(), this.#api.ask("GET /parameters")]);
      this.current.value = current;
      this.parameters.value = parameters
        .filter(({ resource, access }) => resource === "/api/v1/reconstruction" && access === "read-write")
        .map((parameter) => ({ ...parameter, name: parameter.pointer.slice(1) })); // by its name in that document
      this.trouble.value = null;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.trouble.value = error.message;
    }
  }

  /** Sets what is given, everything else to its default; unless another client has changed it since `tag`. */
  async set(settings: Readonly<Record<string, unknown>>, tag: string | null): Promise<void> {
    try {
      await this.#api.setReconstruction(settings, tag);
    } finally {
      await this.refresh();
    }
  }
}
