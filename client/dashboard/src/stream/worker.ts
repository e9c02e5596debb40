/** The worker: owns the socket, decodes, summarises, and hands buffers to the page without copying. */
import { StreamConnection, type ConnectionEvent } from "./connection";
import { decodeMessage, type FrameMessage } from "./protocol";
import { coefficientsOf, summariseLight, summariseMap, type LightSummary, type MapSummary } from "./summary";

/** From the page to the worker. */
export type Command =
  | { readonly type: "open"; readonly url: string; readonly products: readonly string[] }
  | { readonly type: "want"; readonly products: readonly string[] }
  | { readonly type: "acknowledge"; readonly frame: number }
  | { readonly type: "retry" }
  /** A message body fetched over HTTP: the newest frame of a product that no longer streams. */
  | { readonly type: "decode"; readonly body: ArrayBuffer };

/** A frame on its way to the page, with what views need to know of it as a whole. */
export interface FrameReport {
  readonly type: "frame";
  readonly message: FrameMessage;
  readonly bytes: number;
  readonly streamed: boolean;
  readonly map: MapSummary | null;
  readonly light: LightSummary | null;
}

/** From the worker to the page. */
export type Report = FrameReport | ConnectionEvent;

/** What of a worker's global scope is used; lib.webworker and lib.dom cannot be loaded together. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<Command>) => void) | null;
  postMessage(report: Report, transfer: Transferable[]): void;
}

const scope = self as unknown as WorkerScope;
let connection: StreamConnection | null = null;

function report(message: FrameMessage, bytes: number, streamed: boolean): void {
  const coefficients = message.product === "coefficients" ? coefficientsOf(message) : null;
  const frame: FrameReport = {
    type: "frame",
    message,
    bytes,
    streamed,
    map: message.array.shape.length === 2 ? summariseMap(message.array.data) : null,
    light: coefficients === null ? null : summariseLight(coefficients),
  };
  scope.postMessage(frame, [message.array.data.buffer as ArrayBuffer]);
}

function onEvent(event: ConnectionEvent): void {
  if (event.type === "message" && event.message.type === "frame") report(event.message, event.bytes, true);
  else scope.postMessage(event, []);
}

async function cameraState(): Promise<string> {
  const answer = await fetch("/api/v1/camera", { signal: AbortSignal.timeout(4000) });
  const document = (await answer.json()) as { state?: unknown };
  return String(document.state ?? "unknown");
}

scope.onmessage = ({ data: command }) => {
  switch (command.type) {
    case "open":
      connection ??= new StreamConnection(
        command.url,
        {
          openSocket: (url, protocol) => new WebSocket(url, protocol),
          setTimer: (action, delay_s) => setTimeout(action, 1000 * delay_s) as unknown as number,
          clearTimer: (timer) => {
            clearTimeout(timer);
          },
          random: Math.random,
          probe: cameraState,
        },
        onEvent,
      );
      connection.want(command.products);
      break;
    case "want":
      connection?.want(command.products);
      break;
    case "acknowledge":
      connection?.acknowledge(command.frame);
      break;
    case "retry":
      connection?.retryNow();
      break;
    case "decode": {
      const bytes = command.body.byteLength;
      const message = decodeMessage(command.body);
      if (message?.type === "frame") report(message, bytes, false);
      break;
    }
  }
};
