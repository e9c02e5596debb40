import { computed, signal } from "@preact/signals";
import type { InfoDocument } from "../stream/documents";
import { type Api, refusalIn } from "./api";

/** How often a service is looked at that prepares its kernels. */
const PREPARING_MS = 1000;

/** What the service is to this page: who it takes it for, by its token, and what it has still to prepare. */
export class Caller {
  readonly #info = signal<InfoDocument | null>(null);
  /** Null while that is not known. */
  readonly document = computed(() => this.#info.value?.caller ?? null);
  /** Kernels that are not ready, so that frames come slowly; null where all are. */
  readonly kernels = computed(() => this.#info.value?.kernels ?? null);
  /** Why this page may change nothing at all; null where it may. */
  readonly obstacle = computed(() => {
    const caller = this.document.value;
    return caller?.role === "viewer" ? `The token ${caller.name} is a viewer's` : null;
  });
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly api: Api) {}

  /** Asks the service, and again while it prepares its kernels. */
  async look(): Promise<void> {
    clearTimeout(this.#timer);
    try {
      this.#info.value = await this.api.ask("GET /info");
    } catch (error) {
      refusalIn(error);
      this.forget();
    }
    clearTimeout(this.#timer);
    if (this.kernels.peek() !== null) this.#timer = setTimeout(() => void this.look(), PREPARING_MS);
  }

  /** The service does not know this page any more. */
  forget(): void {
    clearTimeout(this.#timer);
    this.#info.value = null;
  }
}
