import { computed, effect, signal, untracked } from "@preact/signals";
import type { LeaseDocument } from "../stream/documents";
import { type Api, refusalIn } from "./api";

/** Who controls the camera; times are of this page's clock. */
export type Control =
  | { readonly kind: "unknown" }
  | { readonly kind: "free" }
  | { readonly kind: "us"; readonly holder: string; readonly expires_s: number }
  | { readonly kind: "other"; readonly holder: string; readonly expires_s: number };

/** How long the lease outlives this page; longer than a minute, which is how seldom a hidden page may get to run. */
const DURATION_S = 90;
const RENEW_S = 20;
/** How soon a renewal that did not reach the service is tried again. */
const RETRY_S = 3;
/** How often another client's lease is read: renewals send no notice. */
const LOOK_S = 5;

/**
 * The lease as this page sees it: taken, renewed while the page steers, given back.
 *
 * While no client holds a lease, every client may change anything.
 */
export class Lease {
  readonly control = signal<Control>({ kind: "unknown" });
  /** Why nothing can be changed from here; null where everything may. */
  readonly obstacle = computed(() => {
    const control = this.control.value;
    return control.kind === "other" ? `${control.holder} controls the camera` : null;
  });
  /** How the page lost the lease without giving it back; null if it did not. */
  readonly lost = signal<string | null>(null);
  #changing = false;
  /** Another read was requested meanwhile. */
  #missed = false;
  /** The lease that this page held is over, and who has one now is not known yet. */
  #orphaned = false;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly api: Api,
    private readonly now_s: () => number = () => Date.now() / 1000,
  ) {
    effect(() => {
      const control = this.control.value;
      untracked(() => this.#arm(control));
    });
  }

  /** Takes the lease, from its holder if `takeover` says so. Raises RequestError. */
  async take(holder: string, takeover: boolean): Promise<void> {
    await this.#alone(async () => {
      const granted = await this.api.ask("POST /lease", { body: { holder, duration_s: DURATION_S, on_lapse: "stop", takeover } });
      this.api.credentials.leaseId.value = granted.lease_id;
      this.lost.value = null;
      this.#orphaned = false;
      this.#take(granted);
    });
  }

  /** Gives the lease back; the camera goes on as it is. */
  async release(): Promise<void> {
    await this.#alone(async () => {
      try {
        const after = await this.api.ask("DELETE /lease");
        this.api.credentials.leaseId.value = null;
        this.#take(after);
      } catch (error) {
        if (refusalIn(error).kind !== "lease-lost") throw error;
      }
    });
  }

  /** Gives the lease back from a page that is being closed; the answer is ignored. */
  abandon(): void {
    if (this.api.credentials.leaseId.peek() !== null) this.api.ask("DELETE /lease", { keepalive: true }).catch(() => undefined);
  }

  /** Looks who controls the camera, and renews what this page holds. */
  async look(): Promise<void> {
    if (this.#changing) {
      this.#missed = true;
      return;
    }
    const ours = this.api.credentials.leaseId.peek();
    try {
      const found = await (ours === null ? this.api.ask("GET /lease") : this.api.ask("PUT /lease", { body: {} }));
      if (this.api.credentials.leaseId.peek() === ours) this.#take(found);
    } catch (error) {
      if (refusalIn(error).kind === "lease-lost" && ours !== null) await this.#forget();
      else this.#arm(this.control.peek(), RETRY_S);
    }
  }

  /** The service refused a change because of the lease: what is shown of it is old. */
  refused(kind: string): void {
    if (kind === "lease-held") void this.look();
    else if (kind === "lease-lost") void this.#forget();
  }

  /** Changes the lease; the notice of that may come before the answer, and says less. */
  async #alone(change: () => Promise<void>): Promise<void> {
    this.#changing = true;
    try {
      await change();
    } finally {
      this.#changing = false;
      if (this.#missed) {
        this.#missed = false;
        await this.look();
      }
    }
  }

  async #forget(): Promise<void> {
    if (this.api.credentials.leaseId.peek() === null) return;
    this.api.credentials.leaseId.value = null;
    this.#orphaned = true;
    await this.look();
  }

  #take({ held, holder, expires_in_s }: LeaseDocument): void {
    const expires_s = this.now_s() + (expires_in_s ?? 0);
    if (this.#orphaned) {
      this.#orphaned = false;
      this.lost.value = held ? `${holder} has taken over control.` : "This page's control has lapsed.";
    } else if (!held && this.control.peek().kind === "other") {
      this.lost.value = null; // the client that took control gave it back
    }
    const kind = this.api.credentials.leaseId.peek() === null ? "other" : "us";
    this.control.value = held ? { kind, holder: holder ?? "Another client", expires_s } : { kind: "free" };
  }

  #arm(control: Control, within_s = Infinity): void {
    clearTimeout(this.#timer);
    if (control.kind !== "us" && control.kind !== "other") return;
    const left_s = Math.max(0.5, control.expires_s - this.now_s() + 0.2);
    const wait_s = Math.min(within_s, control.kind === "us" ? RENEW_S : Math.min(LOOK_S, left_s));
    this.#timer = setTimeout(() => void this.look(), 1000 * wait_s);
  }
}
