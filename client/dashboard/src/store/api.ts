/** The REST side of the service: requests, and problems in plain words. */

import type {
  AcquisitionDocument,
  Answers,
  AppliedDocument,
  Bodies,
  CalibrationDocument,
  CalibrationRequest,
  CalibrationsDocument,
  CameraDocument,
  ExplanationDocument,
  FaultRequest,
  GrantedLeaseDocument,
  InfoDocument,
  JobDocument,
  LeaseDocument,
  LeaseRequest,
  ParameterDocument,
  PixelDocument,
  PlanRequest,
  ReconstructionDocument,
  ReconstructionRequest,
  RecordingDocument,
  RecordingRequest,
  RecordingsDocument,
  SimulationDocument,
  SimulationRequest,
  TimelineDocument,
} from "../stream/documents";
import { frameUrl } from "../stream/frameUrl";
import type { Problem, SequenceRequest } from "../stream/protocol";
import { Credentials } from "./credentials";

/** The service refused a request (RFC 9457), or could not be asked at all. */
export class RequestError extends Error {
  override readonly name = "RequestError";

  constructor(readonly problem: Problem) {
    super(plainWords(problem));
  }

  /** The kind of problem: "lease-held" of "/problems/lease-held"; "" where it has none. */
  get kind(): string {
    return kindOf(this.problem);
  }

  /** It is about a frame that the service kept for some seconds, or never had: it was started anew. */
  get isGone(): boolean {
    return this.kind === "frame-gone" || this.kind === "unknown-frame";
  }
}

/** A problem as a sentence for the person at the screen. */
export function plainWords(problem: Problem): string {
  return problem.detail ?? problem.title ?? "The service refused without giving a reason.";
}

/** The last part of a problem's type. */
export function kindOf(problem: Problem): string {
  return problem.type?.split("/").pop() ?? "";
}

type Fetch = typeof fetch;

type Operation = keyof Answers;

interface RequestDetails<Body = unknown> {
  /** Where, if the path of the operation has a gap or the request a query. */
  readonly at?: string;
  readonly body?: Body;
  readonly signal?: AbortSignal;
  /** Goes out even if the page is closed meanwhile. */
  readonly keepalive?: boolean;
  readonly headers?: Readonly<Record<string, string>>;
}

/** What was read, and the tag of its version, to change just this one. */
export interface Tagged<T> {
  readonly document: T;
  readonly tag: string | null;
}

/** Where the newest frame of the camera is; frames of recordings are elsewhere. */
export const LIVE = "/frames/latest";

/** Where one of the camera's last frames is. */
export const liveFrame = (number: number): string => `/frames/${number}`;

export class Api {
  readonly credentials: Credentials;
  /** Called with every refusal, before the request rejects. */
  onRefusal: ((problem: Problem) => void) | null = null;
  readonly #fetch: Fetch;

  constructor(fetcher: Fetch = (input, init) => fetch(input, init), credentials = new Credentials()) {
    this.#fetch = fetcher;
    this.credentials = credentials;
  }

  // -- the camera --------------------------------------------------------------------------------

  /** What the service is, and who it takes this page for. */
  info(): Promise<InfoDocument> {
    return this.#json("GET /info");
  }

  /** Why frames do not have some products, by their names. */
  async absentProducts(): Promise<Readonly<Record<string, string>>> {
    const { absent_products: absent } = await this.info();
    return Object.fromEntries(absent.map(({ name, reason }) => [name, reason]));
  }

  camera(): Promise<CameraDocument> {
    return this.#json("GET /camera");
  }

  setAcquisition(running: boolean): Promise<AcquisitionDocument> {
    return this.#json("PUT /acquisition", { body: { running } });
  }

  /** Stops the capture and switches the light off, whichever client controls the camera. */
  safeOff(signal: AbortSignal): Promise<AcquisitionDocument> {
    return this.#json("POST /acquisition/safe-off", { signal, keepalive: true });
  }

  /** The number of a frame after `frame`, as soon as there is one; the service waits for it some seconds. */
  async frameAfter(frame: number, wait_s: number): Promise<number> {
    return (await this.#json("GET /frames/{frame}", { at: `${LIVE}?after=${frame}&wait_s=${wait_s}` })).frame;
  }

  /** The number of the newest frame; null before the first. */
  async newestFrame(): Promise<number | null> {
    return (await this.#json("GET /frames")).last;
  }

  /** Everything about one pixel of a frame but its curves, which the page computes itself. */
  pixel(x: number, y: number, frame: string = LIVE): Promise<PixelDocument> {
    return this.#json("GET /frames/{frame}/pixel", { at: frameUrl(frame, `pixel?x=${x}&y=${y}&bins=1`) });
  }

  // -- the sequence ------------------------------------------------------------------------------

  /** Begins to predict what accuracy costs on the scene before the camera: the result is a `TradeoffDocument`, so far while it runs. */
  startTradeoff(): Promise<JobDocument> {
    return this.#json("POST /tradeoff/jobs", { body: { by: "range_error_m" } });
  }

  /** Begins to look for the quickest sequence that reaches the target, or the most accurate within the budget: a `ChoiceDocument`. */
  startPlan(goal: PlanRequest): Promise<JobDocument> {
    return this.#json("POST /plan/jobs", { body: goal });
  }

  validate(sequence: SequenceRequest, signal?: AbortSignal): Promise<AppliedDocument> {
    return this.#json("POST /sequence/validate", { body: sequence, ...(signal === undefined ? {} : { signal }) });
  }

  setSequence(sequence: SequenceRequest): Promise<AppliedDocument> {
    return this.#json("PUT /sequence", { body: sequence });
  }

  // -- control -----------------------------------------------------------------------------------

  lease(): Promise<LeaseDocument> {
    return this.#json("GET /lease");
  }

  takeLease(wanted: LeaseRequest): Promise<GrantedLeaseDocument> {
    return this.#json("POST /lease", { body: wanted });
  }

  renewLease(): Promise<GrantedLeaseDocument> {
    return this.#json("PUT /lease", { body: {} });
  }

  releaseLease(keepalive = false): Promise<LeaseDocument> {
    return this.#json("DELETE /lease", { keepalive });
  }

  // -- recordings --------------------------------------------------------------------------------

  recordings(): Promise<RecordingsDocument> {
    return this.#json("GET /recordings");
  }

  recording(id: string): Promise<RecordingDocument> {
    return this.#json("GET /recordings/{recording}", { at: recordingPath(id) });
  }

  /** Which frames a recording holds, and when they were captured. */
  timeline(id: string): Promise<TimelineDocument> {
    return this.#json("GET /recordings/{recording}/frames", { at: `${recordingPath(id)}/frames` });
  }

  startRecording(wanted: RecordingRequest): Promise<RecordingDocument> {
    return this.#json("POST /recordings", { body: wanted });
  }

  stopRecording(id: string): Promise<RecordingDocument> {
    return this.#json("POST /recordings/{recording}/stop", { at: `${recordingPath(id)}/stop` });
  }

  annotateRecording(id: string, annotations: Readonly<Record<string, unknown>>): Promise<RecordingDocument> {
    return this.#json("PATCH /recordings/{recording}", { at: recordingPath(id), body: { annotations } });
  }

  deleteRecording(id: string): Promise<RecordingDocument> {
    return this.#json("DELETE /recordings/{recording}", { at: recordingPath(id) });
  }

  // -- reconstruction and parameters -------------------------------------------------------------

  /** How frames are computed, with the tag of this version. */
  async reconstruction(): Promise<Tagged<ReconstructionDocument>> {
    const answer = await this.#answer("GET", "/reconstruction");
    return { document: (await answer.json()) as ReconstructionDocument, tag: answer.headers.get("ETag") };
  }

  /** Changes how frames are computed, unless another client has since the version with `tag`. */
  setReconstruction(settings: Readonly<Record<string, unknown>>, tag: string | null): Promise<ReconstructionDocument> {
    const headers = tag === null ? {} : { "If-Match": tag };
    return this.#json("PUT /reconstruction", { body: settings as ReconstructionRequest, headers });
  }

  /** What can be set in the document at a path, and within which limits; by its name in that document. */
  async parameters(path: string): Promise<ParameterDocument[]> {
    const { parameters } = await this.#json("GET /parameters");
    const ours = parameters.filter(({ resource, access }) => resource.replace(/^\/api\/v1/, "") === path && access === "read-write");
    return ours.map((parameter) => ({ ...parameter, name: parameter.pointer.slice(1) }));
  }

  // -- calibrations ------------------------------------------------------------------------------

  calibrations(): Promise<CalibrationsDocument> {
    return this.#json("GET /calibrations");
  }

  /** Starts measuring a calibration; the job says how far it is. */
  measureCalibration(wanted: CalibrationRequest): Promise<JobDocument> {
    return this.#json("POST /calibrations", { body: wanted });
  }

  /** One that was not measured on a diffuser is refused without force. */
  activateCalibration(id: string, force: boolean): Promise<unknown> {
    return this.#json("PUT /calibrations/active", { body: { id, force } });
  }

  /** Returns to the calibration that was active before. */
  restoreCalibration(): Promise<unknown> {
    return this.#json("POST /calibrations/active/undo");
  }

  importCalibration(file: Blob): Promise<CalibrationDocument> {
    return this.#json("POST /calibrations/import", { body: file });
  }

  deleteCalibration(id: string): Promise<CalibrationDocument> {
    return this.#json("DELETE /calibrations/{calibration}", { at: calibrationPath(id) });
  }

  // -- the simulated world -----------------------------------------------------------------------

  simulation(): Promise<SimulationDocument> {
    return this.#json("GET /simulation");
  }

  /** What the scene and the sequence call for. */
  explanation(): Promise<ExplanationDocument> {
    return this.#json("GET /simulation/explain");
  }

  /** Answered once the scene is prepared. */
  setSimulation(wanted: SimulationRequest): Promise<SimulationDocument> {
    return this.#json("PUT /simulation", { body: wanted });
  }

  cause(fault: FaultRequest["fault"]): Promise<SimulationDocument> {
    return this.#json("POST /simulation/faults", { body: { fault } });
  }

  // -- jobs --------------------------------------------------------------------------------------

  async jobs(): Promise<readonly JobDocument[]> {
    return (await this.#json("GET /jobs")).jobs;
  }

  job(id: string): Promise<JobDocument> {
    return this.#json("GET /jobs/{job}", { at: `/jobs/${encodeURIComponent(id)}` });
  }

  cancelJob(id: string): Promise<JobDocument> {
    return this.#json("POST /jobs/{job}/cancel", { at: `/jobs/${encodeURIComponent(id)}/cancel` });
  }

  // -- files -------------------------------------------------------------------------------------

  /** A file of the service, as the browser keeps large ones: not in memory. */
  async file(path: string): Promise<File> {
    const answer = await this.#answer("GET", path);
    const [, name = ""] = /filename="([^"]*)"/.exec(answer.headers.get("Content-Disposition") ?? "") ?? [];
    return new File([await answer.blob()], name);
  }

  /** What the service answers an operation of its interface; no more is checked than that it did not refuse. */
  async #json<Name extends Operation>(
    operation: Name,
    details: RequestDetails<Name extends keyof Bodies ? Bodies[Name] : unknown> = {},
  ): Promise<Answers[Name]> {
    const [method, path] = operation.split(" ");
    return (await this.#answer(method, details.at ?? path, details)).json() as Promise<Answers[Name]>;
  }

  async #answer(method: string, path: string, details: RequestDetails = {}): Promise<Response> {
    const answer = await this.#ask(method, path, details);
    await this.#refuse(answer);
    return answer;
  }

  async #ask(method: string, path: string, { body, signal, keepalive, headers }: RequestDetails): Promise<Response> {
    const raw = body instanceof Blob;
    try {
      return await this.#fetch(`api/v1${path}`, {
        method,
        headers: {
          ...this.credentials.headers(method !== "GET"),
          ...(body === undefined ? {} : { "Content-Type": raw ? "application/octet-stream" : "application/json" }),
          ...headers,
        },
        ...(body === undefined ? {} : { body: raw ? body : JSON.stringify(body) }),
        ...(signal === undefined ? {} : { signal }),
        ...(keepalive === true ? { keepalive } : {}),
      });
    } catch (error) {
      if (error instanceof DOMException && error.name === "AbortError") throw error;
      throw new RequestError({ title: "The service cannot be reached." });
    }
  }

  /** Raises what the service answered unless it is a success. */
  async #refuse(answer: Response): Promise<void> {
    if (answer.ok) return;
    let problem: Problem = { title: `The service answered ${answer.status} ${answer.statusText}.`, status: answer.status };
    try {
      problem = { ...problem, ...((await answer.json()) as Problem) };
    } catch {
      // A proxy's page instead of a problem: the status has to do.
    }
    if (answer.status === 401) this.credentials.refused.value = problem;
    this.onRefusal?.(problem);
    throw new RequestError(problem);
  }
}

export function calibrationPath(id: string): string {
  return `/calibrations/${encodeURIComponent(id)}`;
}

export function recordingPath(id: string): string {
  return `/recordings/${encodeURIComponent(id)}`;
}
