import { type Api, LIVE, RequestError } from "./api";

/** How long the service is asked to wait for a frame at a time; it waits no longer. */
const WAIT_S = 10;

/**
 * Stops the camera, has it capture one frame and stops it again; resolves to the frame's number.
 *
 * `capture_s` is how long one takes. Whatever happens, a stop is sent to the camera.
 */
export async function captureOne(api: Api, capture_s: number): Promise<number> {
  await api.ask("PUT /acquisition", { body: { running: false } });
  const before = (await api.newestFrame()) ?? 0;
  await api.ask("PUT /acquisition", { body: { running: true } });
  try {
    return await frameAfter(api, before, Math.ceil((2 * capture_s) / WAIT_S) + 1);
  } finally {
    await api.ask("PUT /acquisition", { body: { running: false } });
  }
}

async function frameAfter(api: Api, before: number, attempts: number): Promise<number> {
  for (let attempt = 1; ; attempt++) {
    try {
      return (await api.ask("GET /frames/{frame}", { at: `${LIVE}?after=${before}&wait_s=${WAIT_S}` })).frame;
    } catch (error) {
      const early = error instanceof RequestError && error.kind === "no-frame-yet";
      if (!early || attempt >= attempts) throw error;
    }
  }
}
