/** The REST side of the service: requests, and problems in plain words. */

import type { Answers, Bodies, ReconstructionDocument } from "../stream/documents";
import { type Problem, problemOf } from "../stream/protocol";
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

/** The refusal that was caught; raises what is none. */
export function refusalIn(error: unknown): RequestError {
  if (!(error instanceof RequestError)) throw error;
  return error;
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
  /** What the gap in the operation's path is filled with: the id of a recording, a job. */
  readonly of?: string;
  /** Where, if the path has a query or is that of a frame, which may be of a recording. */
  readonly at?: string;
  readonly body?: Body;
  readonly signal?: AbortSignal;
  /** Goes out even if the page is closed meanwhile. */
  readonly keepalive?: boolean;
  readonly headers?: Readonly<Record<string, string>>;
  /** Called with the share of the body that has been sent, 0 to 1. */
  readonly onSent?: (share: number) => void;
}

/** What was read, and the tag of its version, to change just this one. */
export type Tagged<T> = Readonly<{ document: T; tag: string | null }>;

/** Where the newest frame of the camera is; frames of recordings are elsewhere. */
export const LIVE = "/frames/latest";

/** Where what the page made or keeps is: nowhere at the service. */
export const MADE = "";

/** Where one of the camera's last frames is. */
export const liveFrame = (number: number): string => `/frames/${number}`;

export class Api {
  /** Called with every refusal, before the request rejects. */
  onRefusal: ((problem: Problem) => void) | null = null;
  readonly #fetch: Fetch;

  constructor(
    fetcher: Fetch = (input, init) => fetch(input, init),
    readonly credentials = new Credentials(),
    private readonly fetchTelling: (onSent: (share: number) => void) => Fetch = byXMLHttpRequest,
  ) {
    this.#fetch = fetcher;
  }

  /** What the service answers an operation of its interface; no more is checked than that it did not refuse: raises RequestError. */
  async ask<Name extends Operation>(
    operation: Name,
    details: RequestDetails<Name extends keyof Bodies ? Bodies[Name] : unknown> = {},
  ): Promise<Answers[Name]> {
    const [method, path] = operation.split(" ");
    const filled = path.replace(/{\w+}/, encodeURIComponent(details.of ?? ""));
    return (await this.#answer(method, details.at ?? filled, details)).json() as Promise<Answers[Name]>;
  }

  /** The number of the newest frame; null before the first. */
  async newestFrame(): Promise<number | null> {
    return (await this.ask("GET /frames")).last;
  }

  /** How frames are computed, with the tag of this version. */
  async reconstruction(): Promise<Tagged<ReconstructionDocument>> {
    const answer = await this.#answer("GET", "/reconstruction");
    return { document: (await answer.json()) as ReconstructionDocument, tag: answer.headers.get("ETag") };
  }

  /** Changes how frames are computed, unless another client has since the version with `tag`. */
  setReconstruction(settings: Readonly<Record<string, unknown>>, tag: string | null): Promise<ReconstructionDocument> {
    const headers = tag === null ? {} : { "If-Match": tag };
    return this.ask("PUT /reconstruction", { body: settings as Bodies["PUT /reconstruction"], headers });
  }

  /** A file of the service, as the browser keeps large ones: not in memory. */
  async file(path: string): Promise<File> {
    const answer = await this.#answer("GET", path);
    const [, name = ""] = /filename="([^"]*)"/.exec(answer.headers.get("Content-Disposition") ?? "") ?? [];
    return new File([await answer.blob()], name);
  }

  async #answer(method: string, path: string, details: RequestDetails = {}): Promise<Response> {
    const answer = await this.#ask(method, path, details);
    if (answer.ok) return answer;
    const problem = await problemOf(answer);
    if (answer.status === 401) this.credentials.refused.value = problem;
    this.onRefusal?.(problem);
    throw new RequestError(problem);
  }

  async #ask(method: string, path: string, { body, signal, keepalive, headers, onSent }: RequestDetails): Promise<Response> {
    const raw = body instanceof Blob;
    try {
      const fetcher = onSent === undefined ? this.#fetch : this.fetchTelling(onSent);
      return await fetcher(`api/v1${path}`, {
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
}

/** Fetches what says how much of its body has been sent, as `fetch` does not. */
function byXMLHttpRequest(onSent: (share: number) => void): Fetch {
  return (address, { method = "GET", headers = {}, body, signal } = {}) =>
    new Promise((resolve, reject) => {
      const request = new XMLHttpRequest();
      request.open(method, address as string);
      for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
      request.upload.onprogress = ({ loaded, total }) => onSent(loaded / total);
      request.onload = () => resolve(new Response(request.responseText, request));
      request.onerror = () => reject(new TypeError("it was not answered"));
      request.onabort = () => reject(new DOMException("it was given up", "AbortError"));
      signal?.addEventListener("abort", () => request.abort());
      request.send(body as Blob);
    });
}

export function recordingPath(id: string): string {
  return `/recordings/${encodeURIComponent(id)}`;
}
