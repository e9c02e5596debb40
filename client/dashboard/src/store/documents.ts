/** Documents of the service's REST side, as far as the page reads them; frames and sequences are in the protocol. */
import type { AppliedSequence, CameraState } from "../stream/protocol";

export interface AcquisitionDocument {
  readonly running: boolean;
  readonly state: CameraState;
}

/** Who controls the camera. */
export interface LeaseDocument {
  readonly held: boolean;
  readonly holder: string | null;
  readonly expires_in_s: number | null;
  readonly duration_s: number | null;
  readonly on_lapse: "stop" | "keep" | null;
}

/** A lease, for the eyes of its holder. */
export interface GrantedLease extends LeaseDocument {
  readonly lease_id: string;
}

export interface LeaseRequest {
  readonly holder: string;
  readonly duration_s: number;
  readonly on_lapse: "stop" | "keep";
  readonly takeover: boolean;
}

export type RecordingState = "recording" | "finishing" | "complete" | "interrupted" | "recovering" | "damaged";

export interface RecordingDocument {
  readonly id: string;
  readonly name: string;
  readonly state: RecordingState;
  readonly frames: number;
  readonly dropped_frames: number;
  readonly size_bytes: number;
  /** Unix time. */
  readonly started_s: number | null;
  readonly duration_s: number;
  readonly reason: string | null;
  readonly problem: string | null;
  readonly annotations: Readonly<Record<string, unknown>>;
  readonly sequence: AppliedSequence | null;
  /** When it ends by itself; null once it has ended. */
  readonly limits: Readonly<Record<string, number | null>> | null;
}

export interface RecordingsDocument {
  readonly directory: string;
  readonly free_bytes: number | null;
  /** The one that runs. */
  readonly active: string | null;
  /** The newest first. */
  readonly recordings: readonly RecordingDocument[];
}

/** What should be recorded, and until when. */
export interface RecordingRequest {
  readonly name?: string;
  readonly duration_s?: number;
  readonly max_bytes?: number;
  readonly frames?: number;
  /** Begin with what the service still holds of the last so many seconds. */
  readonly history_s?: number;
}

/** Which frames a recording holds, and when they were captured. */
export interface TimelineDocument {
  readonly first: number;
  readonly last: number;
  readonly count: number;
  readonly duration_s: number;
  readonly frame_rate_hz?: number | null;
  /** Since the first frame. */
  readonly times_s?: readonly number[];
}
