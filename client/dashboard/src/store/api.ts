/** The REST side of the service: requests, and problems in plain words. */
import type { AppliedSequence, CameraDocument, CameraState, PixelDocument, Plan, Problem, SequenceDocument, Tradeoff } from "../stream/protocol";

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

export interface AcquisitionDocument {
  readonly running: boolean;
  readonly state: CameraState;
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

  /** Everything about one pixel of the latest frame but its curves, which the page computes itself. */
  pixel(x: number, y: number): Promise<PixelDocument> {
    return this.#json("GET", `/frames/latest/pixel?x=${x}&y=${y}&bins=1`) as Promise<PixelDocument>;
  }

  /** What accuracy costs on the scene of the latest frame; takes the service many seconds. */
  tradeoff(signal: AbortSignal): Promise<Tradeoff> {
    return this.#json("GET", "/tradeoff", undefined, signal) as Promise<Tradeoff>;
  }

  /** The quickest sequence that reaches the target, or the most accurate within the budget. */
  plan(goal: { target: { range_std_m?: number }; budget: { frame_rate_hz?: number } }, signal: AbortSignal): Promise<Plan> {
    return this.#json("POST", "/plan", goal, signal) as Promise<Plan>;
  }

  validate(sequence: SequenceDocument, signal?: AbortSignal): Promise<AppliedSequence> {
    return this.#json("POST", "/sequence/validate", sequence, signal) as Promise<AppliedSequence>;
  }

  setSequence(sequence: SequenceDocument): Promise<AppliedSequence> {
    return this.#json("PUT", "/sequence", sequence) as Promise<AppliedSequence>;
  }

  setAcquisition(running: boolean): Promise<AcquisitionDocument> {
    return this.#json("PUT", "/acquisition", { running }) as Promise<AcquisitionDocument>;
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
