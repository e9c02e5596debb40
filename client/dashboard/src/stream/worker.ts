/** The worker: owns the socket, decodes, summarises, and hands buffers to the page without copying. */

import type { Announcement } from "./announced";
import { type ConnectionEvent, FrameGone, StreamConnection } from "./connection";
import type { CameraDocument } from "./documents";
import { frameUrl } from "./frameUrl";
import { decodeMessage, type Problem, ProtocolError, problemOf } from "./protocol";
import { type FrameReport, summarised } from "./summary";

/** What is passed on to the connection: what it is told, and the value of that. */
type Told = {
  [Name in "want" | "adapt" | "look" | "acknowledge" | "moved" | "rest"]: {
    readonly type: Name;
    readonly value: Parameters<StreamConnection[Name]>[0];
  };
};

/** From the page to the worker. */
export type Command =
  | Told[keyof Told]
  | { readonly type: "open"; readonly url: string; readonly products: readonly string[]; readonly token: string | null }
  | { readonly type: "authenticate"; readonly token: string | null }
  | { readonly type: "retry" }
  | { readonly type: "bring"; readonly ticket: number; readonly path: string; readonly products: readonly string[] };

/** What was brought of a frame; the problem is that of the first product that could not be. */
export type Brought = Readonly<{ type: "brought"; ticket: number; reports: readonly FrameReport[]; problem: Problem | null }>;

/** From the worker to the page. */
export type Report = FrameReport | ConnectionEvent | Brought;

/** What of a worker's global scope is used; lib.webworker and lib.dom cannot be loaded together. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<Command>) => void) | null;
  postMessage(report: Report, transfer: Transferable[]): void;
}

/** Answers about a frame that is not there, or not any more. */
const GONE: readonly number[] = [404, 410];

const scope = self as unknown as WorkerScope;
let connection: StreamConnection | null = null;
let token: string | null = null;
/** Of the interface that the stream is of; a worker's own address is another one. */
let interface_url = "";
/** Is called once that is known: a recording in the page's address is asked for before. */
let opened: () => void = () => undefined;
const open = new Promise<void>((resolve) => {
  opened = resolve;
});

function onEvent(event: ConnectionEvent): void {
  if (event.type === "message" && event.message.type === "frame") {
    scope.postMessage(summarised(event.message), [event.message.array.data.buffer as ArrayBuffer]);
  } else {
    scope.postMessage(event, []);
  }
}

/** What the service answers under the token. */
function ask(path: string, more: RequestInit = {}): Promise<Response> {
  return fetch(interface_url + path, { headers: token === null ? {} : { Authorization: `Bearer ${token}` }, ...more });
}

async function askForCamera(): Promise<CameraDocument> {
  const answer = await ask("/camera", { signal: AbortSignal.timeout(4000) });
  if (!answer.ok) throw new Error(`the service answered ${answer.status}`);
  return (await answer.json()) as CameraDocument;
}

/** What the stream announced. */
async function requestFrame({ frame, product }: Announcement, query: string): Promise<ArrayBuffer> {
  const answer = await ask(`/frames/${frame}/${product}.msgpack${query}`, { cache: "no-store" });
  if (GONE.includes(answer.status)) throw new FrameGone();
  if (!answer.ok) throw new Error(`the service answered ${answer.status}`);
  return answer.arrayBuffer();
}

/** One product of a frame by REST, or why it cannot be had. */
async function fetchProduct(path: string, product: string): Promise<FrameReport | Problem> {
  try {
    const answer = await ask(frameUrl(path, `${product}.msgpack`));
    if (!answer.ok) return await problemOf(answer);
    const message = decodeMessage(await answer.arrayBuffer());
    return message?.type === "frame" ? summarised(message) : { title: "The service sent something else than a frame." };
  } catch (error) {
    return { title: error instanceof ProtocolError ? error.message : "The service cannot be reached." };
  }
}

async function bring(ticket: number, path: string, products: readonly string[]): Promise<void> {
  await open;
  const answers = await Promise.all(products.map((product) => fetchProduct(path, product)));
  const reports = answers.filter((answer): answer is FrameReport => "message" in answer);
  const problem = answers.find((answer): answer is Problem => !("message" in answer)) ?? null;
  const buffers = reports.map(({ message }) => message.array.data.buffer as ArrayBuffer);
  scope.postMessage({ type: "brought", ticket, reports, problem }, buffers);
}

scope.onmessage = ({ data: command }) => {
  switch (command.type) {
    case "open":
      token = command.token;
      interface_url = command.url.replace(/^ws(.*)\/stream$/, "http$1");
      connection ??= new StreamConnection(
        command.url,
        {
          openSocket: (url, protocol) => new WebSocket(url, protocol),
          setTimer: (action, delay_s) => setTimeout(action, 1000 * delay_s) as unknown as number,
          clearTimer: (timer) => clearTimeout(timer),
          now_s: () => performance.now() / 1000,
          random: Math.random,
          probe: askForCamera,
          bring: requestFrame,
        },
        onEvent,
      );
      connection.authenticate(token);
      connection.want(command.products);
      opened();
      break;
    case "authenticate":
      token = command.token;
      connection?.authenticate(token);
      break;
    case "bring":
      void bring(command.ticket, command.path, command.products);
      break;
    case "retry":
      connection?.retryNow();
      break;
    default:
      connection?.[command.type](command.value as never);
  }
};
