import { signal } from "@preact/signals";

import type { Problem } from "../stream/protocol";
import type { Shelf } from "./settings";

const KEY = "transientcam.token";

/**
 * What requests show to be let in, and to be obeyed.
 *
 * The token lies on a shelf that ends with the browser's tab; the lease's id lies nowhere.
 */
export class Credentials {
  readonly token = signal<string | null>(null);
  /** The lease that this page holds; null while it holds none. */
  readonly leaseId = signal<string | null>(null);
  /** Why the service refused the credentials; null while it accepts them. */
  readonly refused = signal<Problem | null>(null);

  constructor(private readonly shelf: Shelf | null = null) {
    try {
      this.token.value = shelf?.getItem(KEY) || null;
    } catch {
      // A shelf that cannot be read holds nothing.
    }
  }

  /** Shows this token from now on; null or nothing forgets the one there is. */
  use(token: string | null): void {
    const shown = token?.trim() || null;
    this.refused.value = null;
    this.token.value = shown;
    try {
      this.shelf?.setItem(KEY, shown ?? "");
    } catch {
      // It is asked for again after a reload, nothing else.
    }
  }

  /** Headers for a request; what changes something is made under the lease. */
  headers(changes: boolean): Record<string, string> {
    const [token, leaseId] = [this.token.peek(), this.leaseId.peek()];
    return {
      ...(token === null ? {} : { Authorization: `Bearer ${token}` }),
      ...(changes && leaseId !== null ? { "Transientcam-Lease": leaseId } : {}),
    };
  }
}
