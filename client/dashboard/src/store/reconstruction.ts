import type { ParameterDocument, ReconstructionDocument } from "../stream/documents";
import type { Api, Tagged } from "./api";
import { Known } from "./known";

/** How frames are computed, and what can be set of it within which limits. */
export class Reconstruction extends Known<Tagged<ReconstructionDocument> & { readonly parameters: readonly ParameterDocument[] }> {
  constructor(private readonly api: Api) {
    super(async () => {
      const [current, { parameters }] = await Promise.all([api.reconstruction(), api.ask("GET /parameters")]);
      const ours = parameters.filter(({ resource, access }) => resource.endsWith("/reconstruction") && access === "read-write");
      // By their names in that document.
      return { ...current, parameters: ours.map((parameter) => ({ ...parameter, name: parameter.pointer.slice(1) })) };
    });
  }

  /** Sets what is given, everything else to its default; unless another client has changed it since `tag`. */
  async set(settings: Readonly<Record<string, unknown>>, tag: string | null): Promise<void> {
    try {
      await this.api.setReconstruction(settings, tag);
    } finally {
      await this.refresh();
    }
  }
}
