/** Long work of the service, followed to its end. */

import type { JobDocument } from "../stream/documents";
import { type Api, refusalIn } from "./api";

/** How often a job is asked how far it is. */
const LOOK_S = 0.4;

export function hasEnded({ state }: JobDocument): boolean {
  return state === "done" || state === "failed" || state === "cancelled";
}

/**
 * Follows a job until it has ended, and answers how; null where the service was started anew and knows it no more.
 *
 * `seen` takes it as it is now and each time it was read. A service that cannot be reached for a while is asked again.
 */
export async function followed(api: Api, started: JobDocument, seen: (job: JobDocument) => void): Promise<JobDocument | null> {
  let job = started;
  seen(job);
  while (!hasEnded(job)) {
    await new Promise((done) => setTimeout(done, 1000 * LOOK_S));
    try {
      job = await api.ask("GET /jobs/{job}", { of: job.id });
      seen(job);
    } catch (error) {
      if (refusalIn(error).problem.status === 404) return null;
    }
  }
  return job;
}
