/** The REST side of the service: requests, and problems in plain words. */
import type { AppliedSequence, Problem, SequenceDocument } from "../stream/protocol";

/** The service refused a request (RFC 9457), or could not be asked at all. */
export class RequestError extends Error {
  override readonly name = "RequestError";

  constructor(readonly problem: Problem) {
    super(plainWords(problem));
  }
}

/** A problem as a sentence for the person at the screen. */
export function plainWords(problem: Problem): string {
  return problem.detail ?? problem.title ?? "The service refused without giving a reason.";
}

export interface CameraDocument {
  readonly state?: string;
  readonly capabilities?: Readonly<Record<string, unknown>>;
  readonly [field: string]: unknown;
}

export interface AcquisitionDocument {
  readonly running: boolean;
}

type Fetch = typeof fetch;

export class Api {
  readonly #fetch: Fetch;

  constructor(fetcher: Fetch = (input, init) => fetch(input, init)) {
    this.#fetch = fetcher;
  }

  camera(): Promise<CameraDocument> {
    return this.#json("GET", "/camera") as Promise<CameraDocument>;
  }

  sequence(): Promise<AppliedSequence> {
    return this.#json("GET", "/sequence") as Promise<AppliedSequence>;
  }

  validate(sequence: SequenceDocument, signal?: AbortSignal): Promise<AppliedSequence> {
    return this.#json("POST", "/sequence/validate", sequence, signal) as Promise<AppliedSequence>;
  }

  setSequence(sequence: SequenceDocument): Promise<AppliedSequence> {
    return this.#json("PUT", "/sequence", sequence) as Promise<AppliedSequence>;
  }

  acquisition(): Promise<AcquisitionDocument> {
    return this.#json("GET", "/acquisition") as Promise<AcquisitionDocument>;
  }

  setAcquisition(running: boolean): Promise<AcquisitionDocument> {
    return this.#json("PUT", "/acquisition", { running }) as Promise<AcquisitionDocument>;
  }

  /** The newest frame of a product as a stream message; null while there is none. */
  async latest(product: string): Promise<ArrayBuffer | null> {
    const answer = await this.#ask("GET", `/frames/latest/${product}.msgpack`);
    if (answer.status === 503) return null;
    await refuse(answer);
    return answer.arrayBuffer();
  }

  async #json(method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<unknown> {
    const answer = await this.#ask(method, path, body, signal);
    await refuse(answer);
    return answer.json();
  }

  async #ask(method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<Response> {
    try {
      return await this.#fetch(`/api/v1${path}`, {
        method,
        ...(body === undefined ? {} : { body: JSON.stringify(body), headers: { "Content-Type": "application/json" } }),
        ...(signal === undefined ? {} : { signal }),
      });
    } catch (error) {
      if (error instanceof DOMException && error.name === "AbortError") throw error;
      throw new RequestError({ title: "The service cannot be reached." });
    }
  }
}

/** Raises what the service answered unless it is a success. */
async function refuse(answer: Response): Promise<void> {
  if (answer.ok) return;
  let problem: Problem = { title: `The service answered ${answer.status} ${answer.statusText}.`, status: answer.status };
  try {
    problem = { ...problem, ...((await answer.json()) as Problem) };
  } catch {
    // A proxy's page instead of a problem: the status has to do.
  }
  throw new RequestError(problem);
}
