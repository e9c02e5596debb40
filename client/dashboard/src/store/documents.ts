/** Documents of the service's REST side, as far as the page reads them; frames and sequences are in the protocol. */
import type { AppliedSequence, CameraState, Problem } from "../stream/protocol";

export interface AcquisitionDocument {
  readonly running: boolean;
  readonly state: CameraState;
}

/** Who the service takes this page for. */
export interface CallerDocument {
  readonly name: string;
  readonly role: "viewer" | "operator" | "admin";
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
  /** Null before there is any. */
  readonly first: number | null;
  readonly last: number | null;
  readonly count: number;
  readonly duration_s: number;
  /** Of every `times_step`-th frame, after the first. */
  readonly times_s: readonly number[];
  readonly times_step: number;
  /** Unix time of the first. */
  readonly host_time_s: number | null;
}

/** How frames are computed: settings by their names, and the number that frames carry. */
export interface ReconstructionDocument {
  readonly reconstruction_id: number;
  readonly [name: string]: unknown;
}

/** Something that can be set, and within which limits. */
export interface ParameterDocument {
  readonly name: string;
  /** The document that it stands in, and where. */
  readonly resource: string;
  readonly pointer: string;
  readonly value: unknown;
  readonly type: "number" | "integer" | "boolean" | "string";
  readonly unit: string | null;
  readonly min: number | null;
  readonly max: number | null;
  readonly allowed: readonly (string | number)[] | null;
  readonly access: "read-write" | "read-only";
  readonly description: string;
}

/** A calibration, and whether it is good for what is captured at present. */
/** Whether a calibration was measured on a diffusor. */
export interface VerdictDocument {
  /** Only a diffusor's is used without force. */
  readonly verdict: "diffusor" | "in-doubt" | "scene";
  readonly reason: string | null;
  readonly block_px: number;
  /** A text for each row of blocks: "." like a diffusor, "#" unlike one, "?" not judged. */
  readonly blocks: readonly string[];
}

export interface CalibrationDocument {
  readonly id: string;
  readonly name: string;
  readonly created_at: number;
  readonly age_s: number;
  readonly device: { readonly model: string; readonly serial: string; readonly width: number; readonly height: number };
  readonly sequence: Readonly<Record<string, unknown>>;
  readonly exposure_s: number;
  readonly temperature_c: number;
  readonly bytes: number;
  readonly fits: boolean;
  /** Why not. */
  readonly reason: string | null;
  readonly active: boolean;
  readonly verdict: VerdictDocument;
  /** Whether it was to be used whatever the verdict. */
  readonly forced: boolean;
  /** Shares of pixels that contradict themselves: now, and when it was measured. */
  readonly drift: { readonly invalid_share: number; readonly invalid_share_at_capture: number | null; readonly frame: number } | null;
}

export interface CalibrationsDocument {
  /** "nominal" for the gains of an ideal modulation. */
  readonly active: string;
  /** What was active before; null where nothing was. */
  readonly former: string | null;
  readonly directory: string;
  /** The newest first. */
  readonly calibrations: readonly CalibrationDocument[];
}

export interface CalibrationRequest {
  readonly name: string;
  readonly frames: number;
  readonly activate: boolean;
}

export type EffectChoice = "auto" | "on" | "off";
export type Fault = "unplug" | "replug" | "corrupt-image" | "drop-image";

/** The world before a simulated camera. */
export interface SimulationDocument {
  readonly scene: string;
  /** What was chosen in place of what the scene says. */
  readonly effects: Readonly<Record<string, EffectChoice>>;
  readonly scenes: readonly { readonly name: string; readonly description: string }[];
  /** Whether filter and diffusor are before the lens. */
  readonly diffusor: boolean;
  readonly plugged: boolean;
  readonly faults: readonly Fault[];
}

/** One effect's answer for the scene and the sequence. */
export interface EffectDocument {
  readonly effect: string;
  readonly choice: EffectChoice | "always";
  readonly called_for: boolean;
  readonly built: boolean;
  readonly reason: string;
  /** Its error in one moment over the noise floor. */
  readonly relative: number;
}

export interface ExplanationDocument {
  readonly noise_floor_dn: number;
  readonly called_above: number;
  readonly effects: readonly EffectDocument[];
}

/** Long work, and where it stands. */
/** What a sequence is wanted for. */
export interface Goal {
  readonly target: { readonly range_error_m?: number };
  readonly budget: { readonly frame_rate_hz?: number };
}

export interface JobDocument {
  readonly id: string;
  readonly kind: string;
  readonly state: "queued" | "running" | "done" | "failed" | "cancelled";
  /** From 0 to 1. */
  readonly progress: number;
  readonly step: string;
  readonly result: Readonly<Record<string, unknown>> | null;
  readonly problem: Problem | null;
}
