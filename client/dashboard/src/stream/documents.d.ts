/** The documents; `python tools/documents.py --write` writes this file. */

/** A product that frames of this camera do not have. */
export interface AbsentDocument {
  readonly name: string;
  readonly reason: string;
}

/** Whether frames are captured, and how fast. */
export interface AcquisitionDocument {
  readonly running: boolean;
  readonly state: "arming" | "starting" | "streaming" | "stopped" | "calibrating" | "lost";
  /** Why the camera is lost, or its light is off or may be on. */
  readonly reason: string | null;
  /** Measured over the last frames; null before there are two. */
  readonly rate_hz: number | null;
  /** Captured since the service started. */
  readonly frames: number;
  /** Since the last frame arrived. */
  readonly frame_age_s: number;
  /** Whether no frame arrived for much longer than one takes. */
  readonly stalled: boolean;
  /** Time until the light goes on, while `state` is `arming`; null else. */
  readonly light_on_in_s: number | null;
  /** What ended the capture: `stop`, `safe-off`, `lapse` of a lease, the `device` (its interlock),
   * that it was `unused` or clients `unserved`, or the `supervisor` beside this service; or why none
   * began: `start`, where the service starts none by itself, and where what is kept of the light is
   * `unreadable` or `unwritable`. Null while it is running, and of a relay. */
  readonly off_because:
    | "stop"
    | "safe-off"
    | "lapse"
    | "device"
    | "unused"
    | "unserved"
    | "supervisor"
    | "start"
    | "unreadable"
    | "unwritable"
    | null;
  /** Whether the light stays off over a restart of the service; false while the disk has not taken
   * it. Null while the capture is running, and of a relay. */
  readonly off_kept: boolean | null;
  /** Counts how often the light was to go off, from a number drawn when the service starts. */
  readonly offs: number;
  /** Whether the light was to go off and may still be on: a relay's origin has not confirmed it,
   * and is asked again until it does. */
  readonly switching_off: boolean;
}

/** What the acquisition should do. */
export interface AcquisitionRequest {
  /** Whether frames are captured; the light is off while they are not, and starts with a delay
   * after it was announced. Starting takes the right `may_light`. */
  readonly running: boolean;
  /** Refuse a start, with `start-outdated`, where the acquisition's `offs` is another number by
   * now; without it, where it has changed since the request arrived. */
  readonly offs?: number | null;
}

/** The calibration that frames are to be calibrated by. */
export interface ActivationRequest {
  /** `nominal` for none. */
  readonly id: string;
  /** Use it even if it was not measured on a diffuser. */
  readonly force?: boolean;
}

/** The calibration that is active, and what frames are really calibrated by. */
export interface ActiveDocument {
  /** `nominal` for the gains that an ideal modulation would have. */
  readonly id: string;
  /** What frames carry: `nominal`, or `factory` of a camera that reports its gains, also where the
   * active one is not good for the sequence. */
  readonly calibration_id: string;
  /** Why it is not. */
  readonly reason: string | null;
  /** That it was measured at another temperature, and what that may do to ranges. */
  readonly warning: string | null;
  /** What was active before, to which `POST /calibrations/active/undo` returns. */
  readonly former: string | null;
}

/** What the service answers, by the request. */
export interface Answers {
  readonly "GET /info": InfoDocument;
  readonly "GET /cameras": NeighboursDocument;
  readonly "GET /camera": CameraDocument;
  readonly "GET /lease": LeaseDocument;
  readonly "POST /lease": GrantedLeaseDocument;
  readonly "PUT /lease": GrantedLeaseDocument;
  readonly "DELETE /lease": LeaseDocument;
  readonly "GET /sequence": AppliedDocument;
  readonly "PUT /sequence": AppliedDocument;
  readonly "POST /sequence/validate": AppliedDocument;
  readonly "GET /reconstruction": ReconstructionDocument;
  readonly "PUT /reconstruction": ReconstructionDocument;
  readonly "GET /calibrations": CalibrationsDocument;
  readonly "POST /calibrations": JobDocument;
  readonly "GET /calibrations/active": ActiveDocument;
  readonly "PUT /calibrations/active": ActiveDocument;
  readonly "POST /calibrations/active/undo": ActiveDocument;
  readonly "POST /calibrations/import": CalibrationDocument;
  readonly "GET /calibrations/{calibration}": CalibrationDocument;
  readonly "DELETE /calibrations/{calibration}": CalibrationDocument;
  readonly "GET /acquisition": AcquisitionDocument;
  readonly "PUT /acquisition": AcquisitionDocument;
  readonly "POST /acquisition/safe-off": AcquisitionDocument;
  readonly "GET /frames": HistoryDocument;
  readonly "GET /frames/{frame}": FrameDocument;
  readonly "GET /frames/{frame}/pixel": PixelDocument;
  readonly "GET /recordings": RecordingsDocument;
  readonly "POST /recordings": RecordingDocument;
  readonly "GET /recordings/{recording}": RecordingDocument;
  readonly "PATCH /recordings/{recording}": RecordingDocument;
  readonly "DELETE /recordings/{recording}": RecordingDocument;
  readonly "POST /recordings/{recording}/stop": RecordingDocument;
  readonly "GET /recordings/{recording}/frames": TimelineDocument;
  readonly "GET /recordings/{recording}/frames/{frame}": FrameDocument;
  readonly "GET /recordings/{recording}/frames/{frame}/pixel": PixelDocument;
  readonly "GET /products": ProductStoresDocument;
  readonly "GET /simulation": SimulationDocument;
  readonly "PUT /simulation": SimulationDocument;
  readonly "GET /simulation/explain": ExplanationDocument;
  readonly "POST /simulation/faults": SimulationDocument;
  readonly "POST /plan": PlanDocument;
  readonly "POST /plan/jobs": JobDocument;
  readonly "GET /tradeoff": TradeoffDocument;
  readonly "POST /tradeoff/jobs": JobDocument;
  readonly "GET /parameters": ParametersDocument;
  readonly "GET /jobs": JobsDocument;
  readonly "GET /jobs/{job}": JobDocument;
  readonly "POST /jobs/{job}/cancel": JobDocument;
  readonly "GET /api/versions": VersionsDocument;
  readonly "GET /livez": LivenessDocument;
  readonly "GET /readyz": ReadinessDocument;
}

/** One version of the interface. */
export interface ApiDocument {
  readonly name: string;
  readonly path: string;
}

/** A sequence as the camera really set it, on the grid of its synthesiser. */
export interface AppliedDocument {
  /** Modulation frequencies are this and its multiples. */
  readonly base_frequency_hz: number;
  /** m: how many multiples. */
  readonly harmonics: number;
  /** Where the zeroth moment comes from; costs four, two or no images (Sec. 4.3). */
  readonly zeroth: "low-frequency" | "on-off" | "estimated";
  /** Of one image. */
  readonly exposure_s: number;
  /** How often each image is captured, for averaging; whole images that are off are left out. */
  readonly takes: number;
  /** Whether takes follow one another as a whole, or image by image. */
  readonly take_order: "sequential" | "interleaved";
  readonly sub_phases: SubPhasesDocument;
  /** The camera's own, as its capabilities state it; null for the multiples 1 to m at four phases.
   * No request has to name it. */
  readonly sampling: SamplingDocument | null;
  /** Counts the sequences the camera was set to; 0 for one that was only checked. */
  readonly sequence_id: number;
  readonly images: number;
  /** From the first exposure to the last read-out of one capture by itself. */
  readonly capture_s: number;
  /** When capturing back to back. */
  readonly frame_rate_hz: number;
  readonly unambiguous_range_m: number;
  readonly data_rate_bytes_s: number;
}

/** What a request sends, where that has a name. */
export interface Bodies {
  readonly "POST /lease": LeaseRequest;
  readonly "PUT /lease": LeaseRenewal;
  readonly "PUT /reconstruction": ReconstructionRequest;
  readonly "POST /calibrations": CalibrationRequest;
  readonly "PUT /calibrations/active": ActivationRequest;
  readonly "PUT /acquisition": AcquisitionRequest;
  readonly "POST /recordings": RecordingRequest;
  readonly "PATCH /recordings/{recording}": RecordingChange;
  readonly "PUT /simulation": SimulationRequest;
  readonly "POST /simulation/faults": FaultRequest;
  readonly "POST /plan": PlanRequest;
  readonly "POST /plan/jobs": PlanRequest;
  readonly "POST /tradeoff/jobs": TradeoffRequest;
}

/** What every density with these moments lies between, smoothed (Sec. 5.2). */
export interface BoundsDocument {
  /** Of the Poisson kernel that it is smoothed with. */
  readonly radius: number;
  /** In DN/s, at `time_s` of the pixel. */
  readonly lower_per_s: readonly (number | null)[];
  readonly upper_per_s: readonly (number | null)[];
}

/** What may be spent; all that is given. */
export interface BudgetDocument {
  /** Time of one capture, at most. */
  readonly capture_s?: number | null;
  /** Frames a second back to back, at least. */
  readonly frame_rate_hz?: number | null;
  /** Share of the time between two frames that reconstruction may take, at most. */
  readonly computing_share?: number | null;
}

/** A calibration, and whether it is good for what is captured at present. */
export interface CalibrationDocument {
  readonly id: string;
  readonly name: string;
  /** Unix time of its last image. */
  readonly created_at: number;
  readonly age_s: number;
  readonly device: DeviceDocument;
  /** What it was measured with, and is good for; the number of takes does not matter. */
  readonly sequence: Readonly<Record<string, unknown>>;
  readonly exposure_s: number;
  /** Of the sensor, while it was measured; null where the camera knows none. */
  readonly temperature_c: number | null;
  /** Size of its file. */
  readonly bytes: number;
  /** Whether it is good for this camera with its present sequence. */
  readonly fits: boolean;
  /** Why not. */
  readonly reason: string | null;
  /** Whether frames are calibrated by it, as long as it fits. */
  readonly active: boolean;
  readonly verdict: VerdictDocument;
  /** Whether it was to be used whatever the verdict, when it was measured. */
  readonly forced: boolean;
  /** Null where they were not measured. */
  readonly harmonics: HarmonicsDocument | null;
  /** Null where it is not active, no frame was calibrated by it yet, or the zeroth moment is
   * estimated, as drift does not show then. */
  readonly drift: DriftDocument | null;
}

/** A calibration that is to be measured with the present sequence. */
export interface CalibrationRequest {
  readonly name?: string;
  /** Captured with the light on, and as many in the dark; averaged without outliers. */
  readonly frames?: number;
  /** Use it at once, if it was measured on a diffuser. */
  readonly activate?: boolean;
  /** Let it be used whatever the verdict on it. */
  readonly force?: boolean;
  /** Sweep the phase as well, to measure the harmonics of the modulation; with 30 frames or more,
   * if the camera can. */
  readonly harmonics?: boolean;
}

/** All calibrations there are. */
export interface CalibrationsDocument {
  /** Id of the active one, or `nominal`. */
  readonly active: string;
  /** What was active before; null where nothing was, or it was deleted. */
  readonly former: string | null;
  /** Where the service keeps them. */
  readonly directory: string;
  /** The newest first. */
  readonly calibrations: readonly CalibrationDocument[];
}

/** The client that sent this request, as the service authenticated it. */
export interface CallerDocument {
  /** of the token; `anybody` where none is required */
  readonly name: string;
  readonly role: "viewer" | "operator" | "admin";
  /** Whether it may do what switches the light on. */
  readonly may_light: boolean;
}

/** The camera: what it can do, and how it is. */
export interface CameraDocument {
  readonly state: "arming" | "starting" | "streaming" | "stopped" | "calibrating" | "lost";
  /** Why it is lost, or its light is off. */
  readonly reason: string | null;
  readonly simulated: boolean;
  /** Of a camera without a watchdog of its own: what switches its light off when this service
   * fails, and what does not; null where the camera does so by itself, or has no light here. */
  readonly light_warning: string | null;
  /** As the camera itself states them; units are in the names. */
  readonly capabilities: Readonly<Record<string, unknown>>;
  /** Where the pixels look: (column, row) along ((c - cx) / fx, (r - cy) / fy, 1), but for the
   * distortion. */
  readonly intrinsics: IntrinsicsDocument;
  /** As it is stated; null where nobody does, and the images of each frame tell their noise. */
  readonly sensor: SensorDocument | null;
  /** Of a relay (docs/relay.md); null where the camera is at this service. */
  readonly origin: OriginDocument | null;
  /** As the camera itself states it now; null while it is lost. */
  readonly status: Readonly<Record<string, unknown>> | null;
  /** What was received since the service started. */
  readonly counters: Readonly<Record<string, number>>;
}

/** A sequence and what is predicted of it. */
export interface ChoiceDocument {
  /** The body for `PUT /sequence`. */
  readonly sequence: SequenceDocument;
  /** What the range is to be taken from, as in `PUT /reconstruction`. */
  readonly estimator: string;
  /** What the camera would make of it. */
  readonly applied: Readonly<Record<string, unknown>>;
  readonly capture_s: number;
  readonly frame_rate_hz: number;
  /** Processor time of one frame on this machine; null as long as the kernels that it needs are
   * not compiled. With a budget `computing_share` they are, before the answer. */
  readonly reconstruct_s: number | null;
  /** That over the time between two frames: what a core is busy with. */
  readonly computing_share: number | null;
  /** Times of a capture: `light_s` of exposure, `readout_s`, and `settling_s` of the modulation;
   * `transport_s` until the last image arrives beyond the least that the link took, by the newest
   * frame, and `computing_s` on one core, null where not known; their `sum_s`. And `light_share`,
   * the part with the light on, which dose and heat go with, and `data_bytes` of images. */
  readonly price: Readonly<Record<string, number | null>>;
  readonly predicted: PredictedDocument;
}

/** A complex number. */
export interface ComplexDocument {
  readonly re: number;
  readonly im: number;
}

/** Where the current frame stands. */
export interface CurrentDocument {
  readonly meta: FrameDocument;
  readonly sequence: SequenceDocument;
  readonly capture_s: number;
  readonly frame_rate_hz: number;
  /** Null for a real camera. */
  readonly range_error_m: RangeErrorDocument | null;
}

/** The camera that a calibration is of. */
export interface DeviceDocument {
  readonly model: string;
  readonly serial: string;
  readonly width: number;
  readonly height: number;
}

/** How well the active calibration still does.
 *
 * A pixel is invalid where its moments contradict each other by more than noise explains (the flag
 * `contradictory`), as they do after thermal drift: a share that has grown much calls for a new
 * calibration. */
export interface DriftDocument {
  /** Of the pixels with light, in the best of the newest frames. */
  readonly invalid_share: number;
  /** The same in the measurement itself; null where it was not counted. */
  readonly invalid_share_at_capture: number | null;
  /** The newest of those frames. */
  readonly frame: number;
}

/** One effect's answer for the scene and the sequence. */
export interface EffectDocument {
  readonly effect: string;
  /** The effect in a few words. */
  readonly what: string;
  readonly choice: "auto" | "on" | "off" | "always";
  readonly called_for: boolean;
  readonly built: boolean;
  readonly reason: string;
  /** The error it causes in one moment, as a root mean square over the lit pixels. */
  readonly size_dn: number;
  /** The same of the errors over each pixel's own noise. */
  readonly relative: number;
  /** The largest error over its noise of any pixel judged. */
  readonly worst: number;
  /** Of one frame, by the order of magnitude. */
  readonly cost_s: number;
}

/** What the simulated scene and the present sequence call for. */
export interface ExplanationDocument {
  readonly scene: string;
  readonly device: string;
  readonly sequence: SequenceDocument;
  /** Of one moment of a typical pixel. */
  readonly noise_floor_dn: number;
  /** An effect is called for above this share of the noise, as a root mean square. */
  readonly called_above: number;
  /** And above this share of its noise in any pixel. */
  readonly called_above_worst: number;
  readonly effects: readonly EffectDocument[];
}

/** What should go wrong. */
export interface FaultRequest {
  readonly fault: "unplug" | "replug" | "corrupt-image" | "drop-image";
}

/** A predicted error of the range in m. */
export interface FigureDocument {
  /** Of the median lit pixel. */
  readonly median: number;
  /** What is measured lies above this with 95 %. */
  readonly low: number;
  /** And below this. */
  readonly high: number;
  /** Of 90 % of the pixels; fewer are better where much light comes back close
   * behind the direct one, as near the edge of a corner, and no frequency resolves it. */
  readonly p90: number;
}

/** One test of a verdict. */
export interface FindingDocument {
  /** What was tested: shares of the pixels, ranges in metres, phases in radian. */
  readonly test: string;
  /** What was found; null where no pixel could be judged. */
  readonly value: number | null;
  /** The most that a diffuser may have, either sign. */
  readonly limit: number;
  readonly unit: "share" | "m" | "rad";
  readonly kept: boolean;
}

/** What is known of a frame, whatever product of it is fetched. */
export interface FrameDocument {
  /** Counted from 1; never resets while the service runs. */
  readonly frame: number;
  readonly sequence_id: number;
  readonly calibration_id: string;
  /** Counts the settings of the reconstruction; those that it was computed with. */
  readonly reconstruction_id: number;
  /** What its range, direct and indirect light are taken from. */
  readonly estimator: string;
  /** Start of the first exposure, by the camera's clock. */
  readonly device_time_s: number;
  /** Arrival of the last image, Unix time. */
  readonly host_time_s: number;
  /** Start of the first exposure, Unix time: the camera's clock, set by that of the service at its
   * first frame. No step of the service's clock moves it. */
  readonly captured_unix_s: number | null;
  /** Measured by the camera's clock. */
  readonly capture_s: number;
  /** Computing time spent on this frame so far; null until something was computed. */
  readonly reconstruct_s: number | null;
  readonly base_frequency_hz: number;
  readonly harmonics: number;
  readonly zeroth: string;
  readonly exposure_s: number;
  readonly takes: number;
  readonly width: number;
  readonly height: number;
  /** Of the sensor; null where the camera knows none. */
  readonly temperature_c: number | null;
  /** Images lost or corrupt between the frame before and this one. */
  readonly lost_images: number;
  /** The relays that it came through, the first one first; none where the camera is here. */
  readonly hops: readonly HopDocument[];
  /** Images left out of the average over takes as outliers; null until it was computed. */
  readonly rejected_images: number | null;
  /** Images that lost their synchronisation, rebuilt from the others; null until computed. */
  readonly repaired_images: number | null;
  /** Images of pairs that contradict the others and could not be rebuilt; null until computed. */
  readonly unrepaired_images: number | null;
  /** Which images are those of the frame before, by their index in it; null until computed. */
  readonly filled_images: readonly number[] | null;
  /** Pixels from whose moments the known harmonics of the modulation were taken out; null where
   * the calibration knows none, and until computed. */
  readonly corrected_pixels: number | null;
  /** Null until something was computed. */
  readonly pixels: PixelCountsDocument | null;
  /** Light in DN an image that is not the camera's, in the median pixel; 0 where it hardly adds
   * noise, null until something was computed and where no sensor is known. */
  readonly ambient_dn: number | null;
  /** Null until the range was computed. */
  readonly predicted_range_std_m: PredictedStdDocument | null;
  /** Null until one of the products range_std, range_bias, range_error, trust was computed. */
  readonly accuracy: RangeAccuracyDocument | null;
}

/** What is known of a frame, and which of its pixels an array holds. */
export interface FrameMeta extends FrameDocument {
  /** column and row of the first pixel, width, height */
  readonly region: readonly [number, number, number, number];
  readonly decimation: number;
}

/** Light that comes back from one range. */
export interface GivenReturnDocument {
  readonly range_m: number;
  /** Relative to the others. */
  readonly weight?: number;
}

/** A lease, for the eyes of its holder. */
export interface GrantedLeaseDocument {
  /** Whether a client does; where none does, every client may. */
  readonly held: boolean;
  /** The name that the holder gave itself. */
  readonly holder: string | null;
  /** How long the lease lasts unless it is renewed. */
  readonly expires_in_s: number | null;
  /** How long it lasts after it was granted or renewed. */
  readonly duration_s: number | null;
  /** What becomes of the capture, and so of the light, when it is not renewed in time. */
  readonly on_lapse: "stop" | "keep" | null;
  /** To be sent in the header Transientcam-Lease with every change; no other client sees it. */
  readonly lease_id: string;
}

/** Odd harmonics of the modulation, over the fundamental; from a phase sweep.
 *
 * They are taken out of the moments, unless `modulation_harmonics` of the reconstruction is
 * `keep`. */
export interface HarmonicsDocument {
  /** 3, 5, 7, ... */
  readonly orders: readonly number[];
  /** Magnitude over that of the fundamental: for each frequency, each order. */
  readonly share: readonly (readonly number[])[];
  /** Phase where that of the fundamental is zero. */
  readonly phase_rad: readonly (readonly number[])[];
  readonly largest_share: number;
}

/** Which frames can be had, and how many may be kept. */
export interface HistoryDocument {
  /** Null before there is any. */
  readonly first: number | null;
  /** Number of the latest frame. */
  readonly last: number | null;
  readonly count: number;
  /** That their raw images take. */
  readonly bytes: number;
  /** From the arrival of the first to that of the last. */
  readonly seconds: number;
  readonly limit_bytes: number;
  readonly limit_seconds: number;
}

/** One relay that a frame came through. */
export interface HopDocument {
  /** Which service relayed it, as its `GET /info` has it. */
  readonly service_id: string;
  /** From its arrival at the service before to that at this relay, by the clocks of both. */
  readonly latency_s: number;
  /** Frames that the service before had and this relay never got, since it began. */
  readonly missed_frames: number;
}

/** What answers here. */
export interface InfoDocument {
  readonly name: string;
  readonly version: string;
  /** Another one with each start of the service. */
  readonly service_id: string;
  /** The `service_id` of this service and of all that it relays; the camera's own is the last. */
  readonly path: readonly string[];
  readonly api: string;
  readonly stream: StreamDocument;
  readonly products: readonly ProductDocument[];
  /** What other cameras have, and why this one does not. */
  readonly absent_products: readonly AbsentDocument[];
  readonly caller: CallerDocument;
  /** Which frames can be had, as in `GET /frames`. */
  readonly history: HistoryDocument;
  /** Streams open now. */
  readonly clients: number;
  /** What frames are computed without until it is compiled: more slowly, with the same results;
   * null where nothing is being prepared. */
  readonly kernels: KernelsDocument | null;
  /** Settings of the reconstruction. */
  readonly reconstruction: Readonly<Record<string, number | string>>;
}

/** A pinhole camera, in pixels; whole numbers are the centres of pixels. */
export interface IntrinsicsDocument {
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
  readonly width: number;
  readonly height: number;
  /** k1, k2, p1, p2, k3 of Brown and Conrady, which OpenCV has in this order; or none. */
  readonly distortion: readonly number[];
  /** How far to the right of the lens the light is. */
  readonly light_x_m: number;
  /** How far below it. */
  readonly light_y_m: number;
  /** How far before it. */
  readonly light_z_m: number;
  /** Its origin: the settings `[lens]`, the camera itself, the simulated scene, the recording,
   * the origin of a relay, or none. */
  readonly source: "settings" | "camera" | "scene" | "recording" | "origin" | "assumed";
}

/** Long work, and where it stands. */
export interface JobDocument {
  readonly id: string;
  /** What it does: `calibration` measures one, `plan` makes one, `tradeoff` finds the front. */
  readonly kind: string;
  readonly state: "queued" | "running" | "done" | "failed" | "cancelled";
  readonly progress: number;
  /** What is being done, in a word or two. */
  readonly step: string;
  /** What came of it; null until it is done. A `tradeoff` has the front so far while it runs, and
   * keeps that when it is cancelled. */
  readonly result: Readonly<Record<string, unknown>> | null;
  /** Why it failed: a problem as a request would be answered with. */
  readonly problem: Readonly<Record<string, unknown>> | null;
  /** Unix time. */
  readonly created_at: number;
  /** Unix time; null until then. */
  readonly finished_at: number | null;
}

/** All jobs that are remembered. */
export interface JobsDocument {
  /** The newest first. */
  readonly jobs: readonly JobDocument[];
}

/** Compiled code for the present sequence and estimator that is still being prepared. */
export interface KernelsDocument {
  /** kernels by their names, the next one first */
  readonly preparing: readonly string[];
  /** about how long it takes until the last one is ready */
  readonly left_s: number;
}

/** Who controls the camera. */
export interface LeaseDocument {
  /** Whether a client does; where none does, every client may. */
  readonly held: boolean;
  /** The name that the holder gave itself. */
  readonly holder: string | null;
  /** How long the lease lasts unless it is renewed. */
  readonly expires_in_s: number | null;
  /** How long it lasts after it was granted or renewed. */
  readonly duration_s: number | null;
  /** What becomes of the capture, and so of the light, when it is not renewed in time. */
  readonly on_lapse: "stop" | "keep" | null;
}

/** New terms of a lease; what is absent stays as it is. */
export interface LeaseRenewal {
  readonly duration_s?: number | null;
  readonly on_lapse?: "stop" | "keep" | null;
}

/** Which client is to control the camera, and on which terms. */
export interface LeaseRequest {
  /** What to call you, for others to read. */
  readonly holder: string;
  /** How long the lease lasts unless it is renewed. */
  readonly duration_s?: number;
  /** What becomes of the capture, and so of the light, when you do not renew it in time. */
  readonly on_lapse?: "stop" | "keep";
  /** Take it from the client that has it, which is notified with all others. */
  readonly takeover?: boolean;
}

/** How the error of the same frequencies falls with capture time. */
export interface LineDocument {
  readonly estimator: string;
  readonly harmonics: number;
  readonly base_frequency_hz: number;
  readonly points: readonly PointDocument[];
}

/** The process answers. */
export interface LivenessDocument {
  readonly status: "alive";
}

/** The service of a camera, as it announces itself. */
export interface NeighbourDocument {
  /** unique on the network */
  readonly name: string;
  /** Of its dashboard, and what clients take as its address. */
  readonly url: string;
  readonly model: string;
  readonly serial: string;
  readonly firmware: string;
  /** versions of its interface */
  readonly api: string;
  readonly tls: boolean;
  /** What its camera does; empty where that is not announced. */
  readonly state: "" | "arming" | "starting" | "streaming" | "stopped" | "calibrating" | "lost";
  /** since it answered, in s */
  readonly seen_s: number;
}

/** The cameras that announce themselves on the local network by mDNS.
 *
 * Everything in it is what they announce: no request was sent to any of them. */
export interface NeighboursDocument {
  readonly cameras: readonly NeighbourDocument[];
  /** how many more were announced */
  readonly left_out: number;
  /** why the network could not be searched */
  readonly reason: string | null;
}

/** The service that this one relays, and what was missed on the way from there. */
export interface OriginDocument {
  readonly url: string;
  readonly service_id: string;
  readonly version: string;
  /** What this relay may do there; a viewer's token changes nothing. */
  readonly role: "viewer" | "operator" | "admin";
  /** What comes from there: images, or their moments alone. */
  readonly product: "raw" | "measured_moments";
  /** Frames that the origin captured and this relay never got, since it began; those across a
   * restart of the origin are not known. */
  readonly missed_frames: number;
  /** Those of them that the origin dropped because relay or network were too slow. */
  readonly dropped_frames: number;
  /** How often the origin was found again. */
  readonly reconnects: number;
  /** How often it was started anew meanwhile. */
  readonly restarts: number;
}

/** One value, and what it may be while the others stay as they are. */
export interface ParameterDocument {
  readonly name: string;
  /** Whose document it stands in: `PUT` that, changed, to set it. */
  readonly resource: string;
  /** Where in that document: a JSON pointer (RFC 6901). */
  readonly pointer: string;
  readonly value: unknown;
  readonly type: "number" | "integer" | "boolean" | "string";
  readonly unit: string | null;
  /** The least that is accepted; null without such a limit. */
  readonly min: number | number | null;
  /** The most that is accepted; null without such a limit. */
  readonly max: number | number | null;
  /** Every value that is accepted; null where they are not counted. */
  readonly allowed: readonly unknown[] | null;
  /** What is `read-only` is set when the service starts, or not at all. */
  readonly access: "read-write" | "read-only";
  readonly description: string;
}

/** All parameters. */
export interface ParametersDocument {
  readonly parameters: readonly ParameterDocument[];
}

/** How many pixels carry each flag; one pixel may carry several. */
export interface PixelCountsDocument {
  readonly total: number;
  readonly valid: number;
  /** Moved to moments that have a density, as sharp returns or noise make it necessary: normal. */
  readonly biased: number;
  readonly no_signal: number;
  readonly saturated: number;
  readonly non_finite: number;
  readonly degenerate: number;
  readonly replaced: number;
  /** Moments that contradict each other by more than noise explains: something is wrong. */
  readonly contradictory: number;
  /** Moments that the returns of the likelihood do not explain: the range may be biased. */
  readonly unexplained: number;
}

/** Everything about one pixel of one frame. */
export interface PixelDocument {
  readonly meta: FrameDocument;
  readonly x: number;
  readonly y: number;
  /** Of the first return; null without one. */
  readonly range_m: number | null;
  readonly direct: number;
  readonly indirect: number;
  readonly brightness: number;
  readonly uniform: number;
  /** Smallest eigenvalue of the moments over the brightness; null without light. */
  readonly validity: number | null;
  /** What was wrong with the pixel; empty for nothing. */
  readonly flags: readonly string[];
  /** b_0 to b_m in DN; of multiples with gaps: b_0, or 0, and those. */
  readonly moments: readonly ComplexDocument[];
  /** By time of flight: the sparse estimate (Theorem 2), with gaps the estimator's. */
  readonly returns: readonly ReturnDocument[];
  /** Of density, cumulative and bounds; all are empty for multiples with gaps. */
  readonly time_s: readonly number[];
  /** The maximum entropy estimate (Theorem 1) in DN/s; null where the pixel has none. */
  readonly density_per_s: readonly (number | null)[];
  /** Light up to each time of flight in DN. */
  readonly cumulative: readonly (number | null)[];
  readonly bounds: BoundsDocument;
  /** Null where the camera is a real one. */
  readonly truth: TruthDocument | null;
}

/** A recommendation and its neighbours. */
export interface PlanDocument {
  /** The body for `PUT /sequence`. */
  readonly sequence: SequenceDocument;
  /** What the range is to be taken from, as in `PUT /reconstruction`. */
  readonly estimator: string;
  /** What the camera would make of it. */
  readonly applied: Readonly<Record<string, unknown>>;
  readonly capture_s: number;
  readonly frame_rate_hz: number;
  /** Processor time of one frame on this machine; null as long as the kernels that it needs are
   * not compiled. With a budget `computing_share` they are, before the answer. */
  readonly reconstruct_s: number | null;
  /** That over the time between two frames: what a core is busy with. */
  readonly computing_share: number | null;
  /** Times of a capture: `light_s` of exposure, `readout_s`, and `settling_s` of the modulation;
   * `transport_s` until the last image arrives beyond the least that the link took, by the newest
   * frame, and `computing_s` on one core, null where not known; their `sum_s`. And `light_share`,
   * the part with the light on, which dose and heat go with, and `data_bytes` of images. */
  readonly price: Readonly<Record<string, number | null>>;
  readonly predicted: PredictedDocument;
  /** The target that neighbours are compared by. */
  readonly compared_by: string;
  /** Noise and bias in a sentence, what half the error costs, and why a bias is not known. */
  readonly summary: string;
  readonly scene: SeenDocument;
  /** Corners of the region whose pixels count. */
  readonly region: readonly (readonly [number, number])[] | null;
  /** Computing time of a frame of the sequence, by estimator; null as in `price`. */
  readonly computing_s: Readonly<Record<string, number | null>>;
  /** What would be, the best first, with the same frequencies and `what`, twice the `light` or a
   * `readout` twice as fast: `capture_s` and `error`, and how many times less they are. */
  readonly changes: readonly Readonly<Record<string, number | string>>[];
  /** What the time goes into, and what would buy most, in a sentence. */
  readonly price_summary: string;
  /** What half the time gives; null where nothing is that quick. */
  readonly half_time: PlanNeighbourDocument | null;
  /** What half the error costs; null where nothing is that accurate. */
  readonly twice_accuracy: PlanNeighbourDocument | null;
}

/** Another choice on the front, beside the recommended one. */
export interface PlanNeighbourDocument {
  /** The body for `PUT /sequence`. */
  readonly sequence: SequenceDocument;
  /** What the range is to be taken from, as in `PUT /reconstruction`. */
  readonly estimator: string;
  /** What the camera would make of it. */
  readonly applied: Readonly<Record<string, unknown>>;
  readonly capture_s: number;
  readonly frame_rate_hz: number;
  /** Processor time of one frame on this machine; null as long as the kernels that it needs are
   * not compiled. With a budget `computing_share` they are, before the answer. */
  readonly reconstruct_s: number | null;
  /** That over the time between two frames: what a core is busy with. */
  readonly computing_share: number | null;
  /** Times of a capture: `light_s` of exposure, `readout_s`, and `settling_s` of the modulation;
   * `transport_s` until the last image arrives beyond the least that the link took, by the newest
   * frame, and `computing_s` on one core, null where not known; their `sum_s`. And `light_share`,
   * the part with the light on, which dose and heat go with, and `data_bytes` of images. */
  readonly price: Readonly<Record<string, number | null>>;
  readonly predicted: PredictedDocument;
  /** Its capture time over the recommended one's. */
  readonly time_factor: number;
  /** Its error over the recommended one's. */
  readonly error_factor: number | null;
}

/** What a sequence is wanted for. */
export interface PlanRequest {
  readonly target?: TargetDocument;
  readonly budget?: BudgetDocument;
  /** Of the pixels of a capture that are to be within the target. Null plans for the error of the
   * median pixel over many captures, which two of three pixels of a capture are within. */
  readonly share?: number | null;
  /** Whose lit pixels count; null for the whole picture. What is outside may saturate. */
  readonly region?: readonly [number, number, number, number] | readonly (readonly [number, number])[] | null;
  /** Whether a job is to predict the error of each pixel, too. */
  readonly map?: boolean;
  /** Fields of the sequence that must stay as given here. */
  readonly fixed?: Readonly<Record<string, unknown>>;
  /** The only estimator to plan with; null considers all of these. */
  readonly estimator?: "single-frequency" | "maximum-entropy" | "likelihood" | "pisarenko" | null;
  /** Null looks at the scene: by a simulated camera of its own in virtual time, or else by the
   * current frame. */
  readonly scene?: SceneDocumentInput | null;
  /** Light on that scene that is not the camera's; null measures it. */
  readonly ambient_dn_per_s?: number | null;
}

/** Predicted errors of the range of the median pixel, in m. */
export interface PointDocument {
  readonly capture_s: number;
  readonly range_std_m: number;
  readonly range_bias_m: number;
  /** With a share what that is within, and of the median pixel without. */
  readonly range_error_m: number;
}

/** Predicted accuracy. */
export interface PredictedDocument {
  /** Noise and bias together: root sum of squares, pixel by pixel. */
  readonly range_error_m: FigureDocument;
  /** Noise: standard deviation between captures. */
  readonly range_std_m: FigureDocument;
  /** How far the mean range of the median pixel is off; more captures do not reduce it. */
  readonly range_bias_m: number;
  /** How far it is off where light begins as early, or as late, as the moments of the look only
   * just allow. */
  readonly range_bias_most_m: number;
  /** Whether the look tells the bias. It does not where shapes of light that explain its moments
   * alike put the range elsewhere, nor where its two estimators disagree about the direct range,
   * nor where many pixels may be lit by other surfaces alone: then `range_bias_m` holds only for
   * the simplest light, and `summary` says why. */
  readonly bias_known: boolean;
  /** What the share of the goal is within; null where the goal is of the median pixel. */
  readonly within: WithinDocument | null;
  /** Shares of the pixels of a capture that are further off than errors in m. */
  readonly beyond: Readonly<Record<string, number>>;
  /** Whether it sees more of the scene than the look that the scene was judged by, so that the
   * prediction is a bound on how good it can be. */
  readonly beyond_scene: boolean;
  readonly bound_width: number | null;
  readonly separation_share: number | null;
}

/** Standard deviation of a frame's range in m between frames, by the noise of the sensor.
 *
 * To first order, of the returns that the frame shows; `range_std` of `accuracy` draws the noise. */
export interface PredictedStdDocument {
  readonly median: number;
  /** 90 % of the pixels are better. */
  readonly p90: number;
  /** Share of the pixels where the noise model holds; that of the others is a rough figure. */
  readonly first_order_share: number;
}

/** A problem as RFC 9457 describes it. */
export interface ProblemDocument {
  /** identifies the kind of problem; a page of this service */
  readonly type: string;
  /** the kind of problem in one sentence */
  readonly title: string;
  /** the HTTP status */
  readonly status: number;
  /** this occurrence in one sentence */
  readonly detail: string;
  /** the path that was requested */
  readonly instance?: string | null;
  /** names the request in the service's log; also in X-Request-ID */
  readonly request_id?: string | null;
  /** the part of the request that was refused */
  readonly field?: string | null;
  /** what it was */
  readonly value?: unknown;
  /** what it may be */
  readonly limit?: unknown;
}

/** An array that can be requested of a frame. */
export interface ProductDocument {
  readonly name: string;
  readonly unit: string;
  readonly axes: readonly string[];
  readonly dtype: string;
  readonly summary: string;
  /** Suffixes it can be had in. */
  readonly formats: readonly string[];
  /** Whether it takes `time_s` or `bins`. */
  readonly over_time: boolean;
  /** Whether the stream offers it. */
  readonly streamed: boolean;
}

/** Products of all frames of a recording, as `transientcam reconstruct` wrote them. */
export interface ProductStoreDocument {
  /** Name of the store, without `.zarr`. */
  readonly id: string;
  /** Names what it holds. At `/products/{id}~{generation}/zarr` a reader gets an error instead of
   * the data of another store that has taken its place. */
  readonly generation: string;
  /** Id of the recording whose products these are; it may have been deleted. */
  readonly recording: string;
  /** What people call that. */
  readonly name: string;
  /** `unfinished`: frames are still computed, or an interrupted run was not gone on with.
   * `damaged`: it cannot be read, and what is said of it is empty. */
  readonly state: "complete" | "unfinished" | "damaged";
  /** Why it cannot be read. */
  readonly problem: string | null;
  readonly frames: number;
  readonly products: readonly string[];
  /** Times of flight of products over time. */
  readonly bins: number;
  /** Settings that they were computed with. */
  readonly reconstruction: Readonly<Record<string, unknown>>;
}

/** Stores of products beside the recordings, by their ids. */
export interface ProductStoresDocument {
  /** Where they are, on the machine of the service: that of the recordings. */
  readonly directory: string;
  readonly stores: readonly ProductStoreDocument[];
}

/** Predicted errors of a frame's range: shares, and in m those of the median pixel with one. */
export interface RangeAccuracyDocument {
  /** Share of all pixels whose range is trusted. */
  readonly trusted_share: number;
  /** Half width of the 90 % interval that 9 of 10 trusted pixels have, or less; null without. */
  readonly within_m: number | null;
  readonly trust: TrustCountsDocument;
  /** Half width of the 90 % interval; null where one frequency knows no bias. */
  readonly range_error_m: number | null;
  /** Standard deviation that the noise of the sensor gives. */
  readonly range_std_m: number | null;
  /** How far it is off for good, as far as the frame shows it; more takes do not reduce it. */
  readonly range_bias_m: number | null;
  /** The errors are those of one pixel in so many rows and columns: more than 1 where not all
   * that predicts them is compiled. */
  readonly every_px: number;
}

/** Error of the range against the simulated truth, in m. */
export interface RangeErrorDocument {
  readonly median: number;
  readonly rms: number;
  /** Of all pixels, those with a range and without direct light: no error counts them. */
  readonly no_direct_light_share: number;
}

/** Frames can be had. */
export interface ReadinessDocument {
  readonly status: "ready";
}

/** How frames are computed. */
export interface ReconstructionDocument {
  /** How moments are averaged over neighbouring pixels. `gaussian` is the paper's.
   * `edge-preserving` averages up to 69 pixels that differ by no more than noise, and none across
   * an edge: the noise falls two to four times further. It needs the noise of the sensor and, in
   * the daemon, a compiled kernel, of at most 8 harmonics; until then it is `gaussian`, as it is in
   * plans. */
  readonly neighbours: "edge-preserving" | "gaussian" | "none";
  /** Standard deviation of the Gaussian that smooths the moments, in pixels; 0 for none. */
  readonly smoothing_px: number;
  /** Smallest eigenvalue every pixel's moments are raised to, over its brightness (Sec. 4.3). */
  readonly bias: number;
  /** Weight from which a return counts as the first, over the pixel's strongest return. */
  readonly return_threshold: number;
  /** What range, direct and indirect light are taken from. `automatic` is `likelihood`, which errs
   * least over the scenes of docs/likelihood.md together; each frame names its `estimator`. The
   * paper's are `pisarenko` and `maximum-entropy`. `likelihood`, `two-returns` and `unwrapped-phase`
   * serve any set of frequencies; for those with gaps `automatic` is `two-returns`, or
   * `unwrapped-phase` where there are but two. The others are there for comparison. Until its kernel
   * is compiled the same estimator runs in NumPy, more slowly. */
  readonly estimator:
    | "automatic"
    | "pisarenko"
    | "maximum-entropy"
    | "likelihood"
    | "single-frequency"
    | "pisarenko-merged"
    | "two-returns"
    | "unwrapped-phase"
    | "inverse-fourier"
    | "godbaz"
    | "spumic"
    | "sra-table"
    | "matrix-pencil"
    | "matching-pursuit"
    | "frequency-domain"
    | "high-frequency";
  /** Pixels with no more light than this have no range. */
  readonly minimum_brightness_dn: number;
  /** Images that lost their synchronisation: rebuilt from the frame's other images, and (`fill`)
   * taken from the frame before where that is impossible; or kept. */
  readonly spoilt_images: "keep" | "repair" | "fill";
  /** Odd harmonics of the modulation, where the calibration has measured them: taken out of the
   * moments, or kept in them. */
  readonly modulation_harmonics: "take-out" | "keep";
  /** Counts the settings from 1; frames carry it in their metadata. */
  readonly reconstruction_id: number;
}

/** How frames should be computed; what is absent takes the paper's value. */
export interface ReconstructionRequest {
  /** How moments are averaged over neighbouring pixels. `gaussian` is the paper's.
   * `edge-preserving` averages up to 69 pixels that differ by no more than noise, and none across
   * an edge: the noise falls two to four times further. It needs the noise of the sensor and, in
   * the daemon, a compiled kernel, of at most 8 harmonics; until then it is `gaussian`, as it is in
   * plans. */
  readonly neighbours?: "edge-preserving" | "gaussian" | "none";
  /** Standard deviation of the Gaussian that smooths the moments, in pixels; 0 for none. */
  readonly smoothing_px?: number;
  /** Smallest eigenvalue every pixel's moments are raised to, over its brightness (Sec. 4.3). */
  readonly bias?: number;
  /** Weight from which a return counts as the first, over the pixel's strongest return. */
  readonly return_threshold?: number;
  /** What range, direct and indirect light are taken from. `automatic` is `likelihood`, which errs
   * least over the scenes of docs/likelihood.md together; each frame names its `estimator`. The
   * paper's are `pisarenko` and `maximum-entropy`. `likelihood`, `two-returns` and `unwrapped-phase`
   * serve any set of frequencies; for those with gaps `automatic` is `two-returns`, or
   * `unwrapped-phase` where there are but two. The others are there for comparison. Until its kernel
   * is compiled the same estimator runs in NumPy, more slowly. */
  readonly estimator?:
    | "automatic"
    | "pisarenko"
    | "maximum-entropy"
    | "likelihood"
    | "single-frequency"
    | "pisarenko-merged"
    | "two-returns"
    | "unwrapped-phase"
    | "inverse-fourier"
    | "godbaz"
    | "spumic"
    | "sra-table"
    | "matrix-pencil"
    | "matching-pursuit"
    | "frequency-domain"
    | "high-frequency";
  /** Pixels with no more light than this have no range. */
  readonly minimum_brightness_dn?: number;
  /** Images that lost their synchronisation: rebuilt from the frame's other images, and (`fill`)
   * taken from the frame before where that is impossible; or kept. */
  readonly spoilt_images?: "keep" | "repair" | "fill";
  /** Odd harmonics of the modulation, where the calibration has measured them: taken out of the
   * moments, or kept in them. */
  readonly modulation_harmonics?: "take-out" | "keep";
  /** Ignored, so that a document that was read can be sent back. */
  readonly reconstruction_id?: number | null;
}

/** What can be changed of a recording. */
export interface RecordingChange {
  /** Replace those it has. */
  readonly annotations: Readonly<Record<string, unknown>>;
}

/** A recording: what is in it, and how it is. */
export interface RecordingDocument {
  /** What requests call it. */
  readonly id: string;
  /** What people call it. */
  readonly name: string;
  /** `interrupted`: its writer died, and the next start of the service recovers it. */
  readonly state: "recording" | "finishing" | "complete" | "interrupted" | "recovering" | "damaged";
  /** Written: they survive the death of the service. */
  readonly frames: number;
  /** Of these, brought to the disk: they survive a power cut, too. Null of an unfinished one that
   * is not written here. */
  readonly synced_frames: number | null;
  /** Frames the disk was too slow for; each frame in the file states how many before it. */
  readonly dropped_frames: number;
  readonly size_bytes: number;
  /** Unix time. */
  readonly started_s: number | null;
  readonly duration_s: number;
  /** Why it ended: `stopped`, `duration`, `size`, `frames`, `disk-space`, `sequence-changed`,
   * `failed`, `shutdown`, or `interrupted`; null while it runs. */
  readonly reason: string | null;
  /** What went wrong, if anything did. */
  readonly problem: string | null;
  readonly annotations: Readonly<Record<string, unknown>>;
  readonly sequence: AppliedDocument | null;
  readonly camera: Readonly<Record<string, unknown>>;
  readonly calibration: Readonly<Record<string, unknown>>;
  readonly width: number | null;
  readonly height: number | null;
  /** Of the software that recorded it. */
  readonly versions: Readonly<Record<string, string>>;
  /** When it ends by itself; null once it has ended. */
  readonly limits: Readonly<Record<string, number | null>> | null;
  /** Of the past that it began with; only in the answer to the request that started it. */
  readonly history_frames: number | null;
}

/** When recordings end by themselves, whatever was requested; null without such a limit. */
export interface RecordingLimitsDocument {
  readonly max_duration_s: number | null;
  readonly max_bytes: number | null;
  /** What the disk keeps. */
  readonly min_free_bytes: number;
}

/** What should be recorded, and until when; the least of all limits ends it. */
export interface RecordingRequest {
  /** For people; without one it is named after the time. */
  readonly name?: string | null;
  /** From now on. */
  readonly duration_s?: number | null;
  readonly max_bytes?: number | null;
  /** Those of the past count, too. */
  readonly frames?: number | null;
  /** Begin with the frames of so many seconds before, as far as `GET /frames` has them; 0 is
   * without. */
  readonly history_s?: number | null;
  /** Anything worth keeping with it, at most 16 KiB as JSON. */
  readonly annotations?: Readonly<Record<string, unknown>>;
}

/** All recordings, the newest first. */
export interface RecordingsDocument {
  /** Where they are kept, on the machine of the service. */
  readonly directory: string;
  /** What its disk has left; null before the first recording made the directory. */
  readonly free_bytes: number | null;
  /** The one that runs. */
  readonly active: string | null;
  readonly limits: RecordingLimitsDocument;
  readonly recordings: readonly RecordingDocument[];
}

/** Light that came back after one time of flight. */
export interface ReturnDocument {
  readonly time_s: number;
  /** In DN. */
  readonly weight: number;
}

/** Which frequencies are measured and at which phases, where a camera has no choice. */
export interface SamplingDocument {
  /** Of the base frequency; empty for 1 to m. */
  readonly multiples: readonly number[];
  /** Of the images of each frequency. */
  readonly phases_rad: readonly number[];
}

/** A scene of equal pixels. */
export interface SceneDocumentInput {
  /** Zeroth moment in DN for each second of exposure. */
  readonly brightness_dn_per_s: number;
  /** Light that is not the camera's, in DN an image for each second of exposure. */
  readonly ambient_dn_per_s?: number;
  readonly returns?: readonly GivenReturnDocument[];
}

/** A scene that comes along. */
export interface SceneDocumentOutput {
  readonly name: string;
  readonly description: string;
}

/** The scene that was planned for, by its median lit pixel. */
export interface SeenDocument {
  readonly range_m: number;
  /** Zeroth moment for each second of exposure. */
  readonly brightness_dn_per_s: number;
  /** Light that is not the camera's, in DN an image for each second of exposure. */
  readonly ambient_dn_per_s: number;
  /** Share of all pixels whose light stands clear of the noise; no others count. */
  readonly lit_share: number;
  /** Share of those that are so dim, at their range, that other surfaces may light them alone. */
  readonly dim_share: number;
  /** Share of the lit pixels that changed while the scene was looked at: what moves is not
   * predicted. */
  readonly moving_share: number;
  /** Whether a second base frequency showed that no range is short by a period. */
  readonly ambiguity_checked: boolean;
}

/** The sensor, which predictions of noise rest on. */
export interface SensorDocument {
  /** Electrons a digital number stands for. */
  readonly gain_e_per_dn: number;
  /** Electrons that a pixel holds. */
  readonly full_well_e: number;
  /** Standard deviation of a read-out, in electrons. */
  readonly read_noise_e: number;
  /** What the converter gives for an empty pixel. */
  readonly dark_dn: number;
  readonly bits: number;
}

/** What the camera captures for one transient image; what is absent keeps its default. */
export interface SequenceDocument {
  /** Modulation frequencies are this and its multiples. */
  readonly base_frequency_hz: number;
  /** m: how many multiples. */
  readonly harmonics: number;
  /** Where the zeroth moment comes from; costs four, two or no images (Sec. 4.3). */
  readonly zeroth: "low-frequency" | "on-off" | "estimated";
  /** Of one image. */
  readonly exposure_s: number;
  /** How often each image is captured, for averaging; whole images that are off are left out. */
  readonly takes: number;
  /** Whether takes follow one another as a whole, or image by image. */
  readonly take_order: "sequential" | "interleaved";
  readonly sub_phases: SubPhasesDocument;
  /** The camera's own, as its capabilities state it; null for the multiples 1 to m at four phases.
   * No request has to name it. */
  readonly sampling: SamplingDocument | null;
}

/** The simulated world before the camera. */
export interface SimulationDocument {
  readonly scene: string;
  /** What was chosen for effects by name, in place of the scene's own choice. */
  readonly effects: Readonly<Record<string, "auto" | "on" | "off">>;
  /** What the camera can be put before. */
  readonly scenes: readonly SceneDocumentOutput[];
  /** Whether filter and diffuser are before the lens, and hide the scene. */
  readonly diffusor: boolean;
  /** Whether the simulated cable is in. */
  readonly plugged: boolean;
  /** What can be made to go wrong. */
  readonly faults: readonly string[];
}

/** What the camera should be put before; what is absent stays. */
export interface SimulationRequest {
  readonly scene?: string | null;
  /** In its place the text of a scene's file (TOML); it may name no other file. */
  readonly definition?: string | null;
  /** By name, in place of all earlier choices; of the others the scene decides. */
  readonly effects?: Readonly<Record<string, "auto" | "on" | "off">> | null;
  /** Put filter and diffuser before the lens, to measure a calibration, or take them away.
   *
   * Also accepted as `diffusor`, which answers call it. */
  readonly diffuser?: boolean | null;
}

/** Where the stream is. */
export interface StreamDocument {
  readonly path: string;
  readonly subprotocol: string;
  /** where its messages are described, as AsyncAPI 3 */
  readonly asyncapi: string;
  /** which a subscription may request */
  readonly encodings: readonly string[];
}

/** How one exposure is divided between phases (Sec. 4.1). */
export interface SubPhasesDocument {
  /** How its parts are chosen; `none` has one. */
  readonly scheme: "arccos" | "harmonic-cancellation" | "none";
  /** How many parts. */
  readonly n: number;
}

/** What has to be reached; all that is given. */
export interface TargetDocument {
  /** How far the range is off, noise and bias together, at most; in `share` of the pixels. */
  readonly range_error_m?: number | null;
  /** Standard deviation of the range of a typical pixel, at most. */
  readonly range_std_m?: number | null;
  /** Distance at which two equal returns are both found. */
  readonly separation_m?: number | null;
  /** Share of captures in which both are found. */
  readonly separation_share?: number;
  /** Width of the bounds on the density over the mean density, at most. */
  readonly bound_width?: number | null;
}

/** Which frames a recording has, and when they were captured. */
export interface TimelineDocument {
  /** Recorded frames are counted from 1; null before there is any. */
  readonly first: number | null;
  readonly last: number | null;
  readonly count: number;
  /** From the first to the last. */
  readonly duration_s: number;
  /** On average; null before there are two. */
  readonly frame_rate_hz: number | null;
  /** Capture of the first frame, Unix time. */
  readonly host_time_s: number | null;
  /** Capture of every `times_step`-th frame, beginning with the first, after the first. */
  readonly times_s: readonly number[];
  /** 1 unless there are very many. */
  readonly times_step: number;
}

/** What accuracy costs on the scene before the camera. */
export interface TradeoffDocument {
  readonly compared_by: string;
  /** Number of the frame that the scene was judged by. */
  readonly scene_of_frame: number;
  readonly current: CurrentDocument;
  /** By rising capture time and falling error. */
  readonly front: readonly ChoiceDocument[];
  /** Of every estimator and set of frequencies on the front: noise falls onto the bias. */
  readonly lines: readonly LineDocument[];
  /** From where on bias rules and time buys little, and the best there is, in a sentence. */
  readonly summary: string;
}

/** What the front is wanted for. */
export interface TradeoffRequest {
  /** The accuracy that capture time is held against. */
  readonly by?: "range_error_m" | "range_std_m" | "bound_width";
  /** Of the pixels of a capture, whose error counts; null for that of the median pixel. */
  readonly share?: number | null;
  /** Whose pixels count; null for the whole picture. */
  readonly region?: readonly [number, number, number, number] | readonly (readonly [number, number])[] | null;
}

/** How many pixels the product `trust` has under each code, in the order of the codes from 0. */
export interface TrustCountsDocument {
  readonly trusted: number;
  /** There is none: too little light, or too much, as the flags say. */
  readonly no_range: number;
  /** An image of the frame was lost or out of step, and could not be rebuilt. */
  readonly corrupt_image: number;
  /** The light of the pixel changed while the frame was captured. */
  readonly motion: number;
  /** No surface at this range can be this bright by the lamp's own light: it came around. */
  readonly no_direct_light: number;
  /** What is nearer stands between the lamp and this point. */
  readonly shadow: number;
  /** Near and far meet within the pixel or beside it. */
  readonly edge: number;
  /** Later light is merged with the first: estimators disagree by much. */
  readonly later_light_unresolved: number;
  /** A return found close behind the first one may have moved it by much. */
  readonly later_light: number;
  /** The camera is far from its calibration's temperature, or moments contradict each other. */
  readonly drift: number;
  /** The noise leaves the range open, or threw it off all around. */
  readonly noise: number;
}

/** What the simulated scene really holds at a pixel. */
export interface TruthDocument {
  readonly kind: string;
  /** That of the surface which is seen, lit or not. */
  readonly range_m: number | null;
  /** Of the light, what came straight from the lamp by that surface: 0 where there is none. */
  readonly direct_share: number | null;
  /** The first return. */
  readonly direct: number;
  readonly brightness: number;
  /** At most the 16 strongest. */
  readonly returns: readonly ReturnDocument[];
}

/** Whether a calibration was measured on a diffuser, by what its images look like.
 *
 * Through a diffuser all pixels see one return at the same time; a scene has ranges, and several
 * returns in a pixel. */
export interface VerdictDocument {
  /** Only the first is used without `force`. */
  readonly verdict: "diffusor" | "in-doubt" | "scene";
  /** What speaks against a diffuser; null where nothing does. */
  readonly reason: string | null;
  readonly tests: readonly FindingDocument[];
  /** Side in pixels of the blocks that were judged. */
  readonly block_px: number;
  /** A text for each row of blocks: `.` like a diffuser, `#` unlike one, `?` not judged. */
  readonly blocks: readonly string[];
  /** What it was compared with: the id of a calibration, or `nominal`. */
  readonly reference: string;
}

/** Which interfaces are served. */
export interface VersionsDocument {
  readonly name: string;
  readonly version: string;
  readonly api: readonly ApiDocument[];
}

/** How many pixels of a capture are how close, noise and bias together. */
export interface WithinDocument {
  /** Of the pixels, as the goal has it. */
  readonly share: number;
  /** So many are within this. */
  readonly error_m: number;
  readonly low: number;
  /** It is measured between them with 90 %. */
  readonly high: number;
  readonly target_m: number | null;
  /** So many are within the target. */
  readonly target_share: number | null;
}

export type Notice =
  | {
      readonly type: "notice";
      readonly kind: "dropped";
      readonly channel: number;
      readonly count: number;
      readonly total: number;
      readonly unacknowledged?: number;
    }
  | {
      readonly type: "notice";
      readonly kind: "gap";
      readonly from: number;
      readonly to: number;
      readonly reason: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "lost-images";
      readonly count: number;
      readonly frame: number;
    }
  | {
      readonly type: "notice";
      readonly kind: "camera-lost";
      readonly reason: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "camera-back";
    }
  | {
      readonly type: "notice";
      readonly kind: "light-arming";
      readonly in_s: number;
    }
  | {
      readonly type: "notice";
      readonly kind: "light-off";
      readonly because: string;
      readonly reason: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "light-unconfirmed";
      readonly reason: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "light-confirmed";
    }
  | {
      readonly type: "notice";
      readonly kind: "sequence-changed";
      readonly sequence: Readonly<Record<string, unknown>>;
      readonly channels: readonly unknown[];
    }
  | {
      readonly type: "notice";
      readonly kind: "recording-started";
      readonly recording: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "recording-dropped";
      readonly count: number;
      readonly total: number;
    }
  | {
      readonly type: "notice";
      readonly kind: "disk-stalled";
      readonly recording: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "recording-stopped";
      readonly recording: string;
      readonly reason: string;
      readonly problem: string | null;
      readonly frames: number;
      readonly dropped_frames: number;
    }
  | {
      readonly type: "notice";
      readonly kind: "lease-changed";
      readonly change: string;
      readonly holder: string;
      readonly from?: string;
    }
  | {
      readonly type: "notice";
      readonly kind: "calibration-changed";
      readonly calibration_id: string;
      readonly reason: string | null;
      readonly warning?: string | null;
    }
  | {
      readonly type: "notice";
      readonly kind: "noise-differs";
      readonly ratio: number;
      readonly reason: string | null;
    }
  | {
      readonly type: "notice";
      readonly kind: "reconstruction-changed";
      readonly reconstruction: Readonly<Record<string, unknown>>;
    }
  | {
      readonly type: "notice";
      readonly kind: "simulation-changed";
      readonly scene: string;
      readonly effects: Readonly<Record<string, unknown>>;
      readonly diffusor?: boolean;
    }
  | {
      readonly type: "notice";
      readonly kind: "job-changed";
      readonly job: Readonly<Record<string, unknown>>;
    };
