import { signal } from "@preact/signals";
import type { CameraState } from "../stream/protocol";
import { type Api, RequestError } from "./api";

/** How long an answer is waited for, and until the request goes out again. */
const ANSWER_MS = 2000;
const AGAIN_MS = 1000;

/** What became of the last request to switch the light off; null where there is none that is open. */
export type LightOffState =
  | { readonly kind: "sent" }
  /** The service has not confirmed it: the light may be on. It is requested until it is confirmed. */
  | { readonly kind: "unconfirmed"; readonly reason: string }
  /** This page may not: asking again is in vain. */
  | { readonly kind: "refused"; readonly reason: string };

/** Switches the light off, and does not give up before the service has confirmed it. */
export class LightOff {
  readonly state = signal<LightOffState | null>(null);
  /** Counts presses: an answer to an earlier one changes nothing. */
  #press = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly api: Api,
    private readonly done: (state: CameraState) => void,
  ) {}

  press(): void {
    this.withdraw();
    this.state.value = { kind: "sent" };
    void this.#send(this.#press);
  }

  /** The user has something else done: no further request goes out. */
  withdraw(): void {
    this.#press++;
    clearTimeout(this.#timer);
    this.state.value = null;
  }

  async #send(press: number): Promise<void> {
    let next: LightOffState | null = null;
    try {
      const { state } = await this.api.ask("POST /acquisition/safe-off", { signal: AbortSignal.timeout(ANSWER_MS), keepalive: true });
      if (press === this.#press) this.done(state);
    } catch (error) {
      const refused = error instanceof RequestError && [401, 403].includes(error.problem.status ?? 0);
      const reason = error instanceof RequestError ? error.message : "The service does not answer.";
      next = { kind: refused ? "refused" : "unconfirmed", reason };
    }
    if (press !== this.#press) return;
    this.state.value = next;
    if (next?.kind === "unconfirmed") this.#timer = setTimeout(() => void this.#send(press), AGAIN_MS);
  }
}
