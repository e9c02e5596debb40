/** The worker: owns the socket, decodes, summarises, and hands buffers to the page without copying. */
import { StreamConnection, type ConnectionEvent } from "./connection";
import type { CameraDocument } from "./protocol";
import { type FrameReport, summarised } from "./summary";

/** From the page to the worker. */
export type Command =
  | { readonly type: "open"; readonly url: string; readonly products: readonly string[] }
  | { readonly type: "want"; readonly products: readonly string[] }
  | { readonly type: "acknowledge"; readonly frame: number }
  | { readonly type: "retry" };

/** From the worker to the page. */
export type Report = FrameReport | ConnectionEvent;

/** What of a worker's global scope is used; lib.webworker and lib.dom cannot be loaded together. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<Command>) => void) | null;
  postMessage(report: Report, transfer: Transferable[]): void;
}

const scope = self as unknown as WorkerScope;
let connection: StreamConnection | null = null;

function onEvent(event: ConnectionEvent): void {
  if (event.type === "message" && event.message.type === "frame") {
    scope.postMessage(summarised(event.message), [event.message.array.data.buffer as ArrayBuffer]);
  } else {
    scope.postMessage(event, []);
  }
}

async function askForCamera(): Promise<CameraDocument> {
  const answer = await fetch("/api/v1/camera", { signal: AbortSignal.timeout(4000) });
  if (!answer.ok) throw new Error(`the service answered ${answer.status}`);
  return (await answer.json()) as CameraDocument;
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
          probe: askForCamera,
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
  }
};
