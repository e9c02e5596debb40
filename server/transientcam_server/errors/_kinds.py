"""Every kind of problem this service answers with, each with a page of its own."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem: its HTTP status, what it means, and the last part of its type URI."""

    status: int
    title: str
    meaning: str
    slug: str = ""
    """Of the kinds below it is their name here, as ``bad-request``."""

    @property
    def type(self) -> str:
        """The URI that identifies the kind; the service answers it with a page."""
        return f"/problems/{self.slug}"


BAD_REQUEST: Final = ProblemKind(
    400, "Bad request", "The request is not valid HTTP, or its body is not valid JSON."
)
HOST_NOT_ALLOWED: Final = ProblemKind(
    403,
    "Host not allowed",
    "The Host header names none of the hosts that this service answers to. The check protects a "
    "service on the loopback interface from DNS rebinding. Add the name to the setting "
    "allowed_hosts.",
)
ORIGIN_NOT_ALLOWED: Final = ProblemKind(
    403,
    "Origin not allowed",
    "A page of another origin sent a request that changes something, opened the stream, or loads "
    "something from here as a part of it. Add its origin to the setting allowed_origins if that is "
    "intended.",
)
TOKEN_REQUIRED: Final = ProblemKind(
    401,
    "Authentication required",
    "This service can be reached from other machines and therefore requires a token: in the header "
    "Authorization (Bearer) or X-API-Key, or on the stream in the first message. `transientcam "
    "token create` makes one. The stream closes with code 4003.",
)
TOKEN_REFUSED: Final = ProblemKind(
    401,
    "Invalid token",
    "The token is unknown, was revoked or has expired. The stream closes with code 4003.",
)
ROLE_TOO_LOW: Final = ProblemKind(
    403,
    "Insufficient role",
    "The token's role (`value`) does not permit this request; `limit` is the role that it "
    "requires.",
)
MAY_NOT_LIGHT: Final = ProblemKind(
    403,
    "Not allowed to switch the light on",
    "The token has not the right `may_light`, which is required by whatever starts the light: "
    "capturing and measuring a calibration. Switching it off needs no more than a token. "
    "`transientcam token create` makes tokens with it and without it.",
)
NOT_FOUND: Final = ProblemKind(
    404, "Not found", "No resource has this path. /docs lists all of them."
)
UNKNOWN_PRODUCT: Final = ProblemKind(
    404,
    "Unknown product",
    "The product is not among those that a frame of this camera has; `known` lists them. `truth` "
    "exists only where the camera is simulated.",
)
NOT_SIMULATED: Final = ProblemKind(
    404,
    "Camera not simulated",
    "The request is about the simulated scene of a simulated camera, and this camera is a real "
    "one.",
)
ONLY_MOMENTS: Final = ProblemKind(
    409,
    "Moments alone",
    "This service relays the moments of another one, without the images they are of. What needs "
    "images, or is done with them before there are moments, is to be requested at `origin`; or "
    "relay it with `product=raw`.",
)
UNKNOWN_RECORDING: Final = ProblemKind(
    404,
    "Unknown recording",
    "No recording has this id; the list of recordings has those that exist.",
)
UNKNOWN_PRODUCT_STORE: Final = ProblemKind(
    404,
    "Unknown store of products",
    "No store of products has this id; the list of stores has those that lie beside the "
    "recordings.",
)
UNKNOWN_CALIBRATION: Final = ProblemKind(
    404,
    "Unknown calibration",
    "No calibration has this id; the list of calibrations has those that exist.",
)
UNKNOWN_JOB: Final = ProblemKind(
    404, "Unknown job", "No job has this id. Jobs that have ended are removed after a while."
)
UNKNOWN_FRAME: Final = ProblemKind(
    404,
    "Unknown frame",
    "No frame has this number; `first` and `last` state which are available. `wait_s` lets the "
    "request wait for a frame that is not captured yet.",
)
FRAME_GONE: Final = ProblemKind(
    410,
    "Frame no longer available",
    "Raw frames are kept for the settings history.seconds and history.max_bytes; `first` and "
    "`last` state which are still available. Record frames that are needed for longer.",
)
METHOD_NOT_ALLOWED: Final = ProblemKind(
    405,
    "Method not allowed",
    "The path exists, but not for this method; the Allow header lists those that do.",
)
NOT_ACCEPTABLE: Final = ProblemKind(
    406,
    "Format not available",
    "Neither the suffix nor the Accept header names a format that this product has; `supported` "
    "lists them. Only products with one value a pixel can be a PNG.",
)
LEASE_HELD: Final = ProblemKind(
    409,
    "Lease held by another client",
    "While a client holds the lease, only requests that name it in the header Transientcam-Lease "
    "change anything. `holder` names that client and `expires_in_s` states how long the lease "
    "lasts unless it is renewed. Reading needs no lease.",
)
LEASE_LOST: Final = ProblemKind(
    409,
    "Lease lost",
    "The lease that the header Transientcam-Lease names was released, taken over or not renewed in "
    "time. `holder` names the client that holds one now. Nothing was changed.",
)
RECORDING_RUNS: Final = ProblemKind(
    409,
    "Recording already running",
    "One recording runs at a time; `recording` is its id. Stop it first.",
)
RECORDING_UNFINISHED: Final = ProblemKind(
    409,
    "Recording not finished",
    "It is still being written, or its writer died and it was not recovered yet; the service "
    "recovers such recordings when it starts.",
)
PRODUCT_STORE_UNFINISHED: Final = ProblemKind(
    409,
    "Store of products not finished",
    "Frames are still computed into it, or that was interrupted; the same `transientcam "
    "reconstruct` goes on. Where frames are missing it would read as zeros.",
)
CALIBRATION_MISFIT: Final = ProblemKind(
    409,
    "Calibration does not fit",
    "A calibration fits the camera, the sequence and the exposure that it was measured with. "
    "`field` names what differs, `value` is the present value and `limit` the one that the "
    "calibration fits. Frames are computed as before.",
)
CALIBRATION_DOUBTED: Final = ProblemKind(
    409,
    "Calibration was not measured on a diffuser",
    "Its measurement does not look like a diffuser's: `detail` says what speaks against it, "
    "`verdict` is `in-doubt` or `scene`, and `tests` has the figures. Used anyway, ranges may be "
    "wrong everywhere; `force` does so. Frames are computed as before.",
)
NO_FORMER_CALIBRATION: Final = ProblemKind(
    409, "No former calibration", "No other calibration was active before, or it was deleted."
)
ESTIMATOR_MISFIT: Final = ProblemKind(
    409,
    "Estimator needs more harmonics",
    "The estimator that the reconstruction takes the range from needs more harmonics than the "
    "sequence has. `field` names the value that was refused, `value` repeats it and `limit` states "
    "what is possible. Frames are computed as before, except for the products that depend on the "
    "estimator.",
)
CALIBRATION_IN_USE: Final = ProblemKind(
    409,
    "Calibration in use",
    "It is the active one, or the one that the service was started with. Activate another one, or "
    "`nominal`, before deleting it.",
)
CAMERA_BUSY: Final = ProblemKind(
    409,
    "Camera busy with a calibration",
    "A job has exclusive use of the camera until it has ended; `job` is its id. Cancel it, or wait "
    "for it. Switching the light off is possible meanwhile, and ends the job.",
)
START_OUTDATED: Final = ProblemKind(
    409,
    "The light was switched off meanwhile",
    "The light was to go off after this start was asked for, or the service was started anew: it "
    "stays off. Ask again if it is to go on.",
)
RECORDING_DAMAGED: Final = ProblemKind(
    409,
    "Recording damaged",
    "The file, or this frame of it, is not what was written. Other frames may be intact.",
)
REQUEST_LATE: Final = ProblemKind(
    408,
    "Request timeout",
    "The head or the body of the request was not complete within `limit` seconds; see "
    "limits.head_s and limits.body_s. The connection is closed.",
)
SEQUENCE_CHANGED: Final = ProblemKind(
    412,
    "Sequence has changed",
    "The request was about the sequence that If-Match names, which is no longer the running one. "
    "`value` repeats the tag, `current` is that of the running one. Nothing was changed.",
)
RECONSTRUCTION_CHANGED: Final = ProblemKind(
    412,
    "Reconstruction settings have changed",
    "The request was about the settings that If-Match names, which are no longer in use. `value` "
    "repeats the tag, `current` is that of those in use. Nothing was changed.",
)
HEAD_TOO_LARGE: Final = ProblemKind(
    431,
    "Request head too large",
    "Request line and headers together are longer than `limit` bytes; see limits.head_bytes.",
)
TOO_MANY_JOBS: Final = ProblemKind(
    429,
    "Too many jobs",
    "`limit` jobs run or wait already. Cancel one, or try again when one has ended.",
)
TOO_MANY_FROM_ONE_ADDRESS: Final = ProblemKind(
    429,
    "Too many connections from one address",
    "As many connections as limits.max_connections_per_address allows are open from there.",
)
TOO_MANY_CONNECTIONS: Final = ProblemKind(
    503,
    "Too many connections",
    "As many connections as limits.max_connections allows are open. Try again in a while.",
)
TOO_MANY_ANSWERS: Final = ProblemKind(
    503,
    "Too many answers on their way",
    "As many bytes are on their way to clients as limits.answers_bytes allows, or to this address "
    "as limits.answers_bytes_per_address does. Read what was answered, then try again.",
)
PLANNING_BUSY: Final = ProblemKind(
    503,
    "Too many requests for plans",
    "One plan is computed at a time, and few requests wait for one: `limit` states how many. Try "
    "again when one of them was answered.",
)
PLANNING_ENDED: Final = ProblemKind(
    503,
    "Planning process ended",
    "The process that computes plans ended before it answered: it was killed, or had too little "
    "memory. Frames, recordings and other requests go on. Try again.",
)
PLAN_TOO_LONG: Final = ProblemKind(
    504,
    "The plan takes too long",
    "What is planned was given up after `limit` seconds, the setting `limits.plan_s`. Fewer takes, "
    "a smaller budget or an estimator that is named take less.",
)
TOO_LARGE: Final = ProblemKind(
    413, "Request body too large", "The body is longer than `limit` bytes."
)
RANGE_NOT_SATISFIABLE: Final = ProblemKind(
    416,
    "Range not satisfiable",
    "The Range header names bytes beyond the end of the file, whose size `limit` states.",
)
INVALID_REQUEST: Final = ProblemKind(
    422,
    "Invalid request",
    "`field` names the value that was refused, `value` repeats it and `limit` states what is "
    "possible. `errors` lists all of them where there are several. Nothing was changed.",
)
INVALID_SEQUENCE: Final = ProblemKind(
    422,
    "Invalid sequence",
    "`field` of the sequence is out of the range of this camera, which `limit` states. The "
    "sequence that was running before is still running.",
)
INVALID_CALIBRATION: Final = ProblemKind(
    422,
    "Invalid calibration",
    "The file cannot be read as one that this service or `transientcam calibrate` has written. "
    "`field` names the part that is wrong, `value` what it is and `limit` what it should be.",
)
ANSWER_TOO_LARGE: Final = ProblemKind(
    422,
    "Response too large",
    "The product at this many times of flight would exceed the limit on one response. Request "
    "fewer times, or take `coefficients` and evaluate them in the client. As msgpack or npy, which "
    "are computed while they are sent, an answer may be larger than in other formats.",
)
TARGET_UNREACHABLE: Final = ProblemKind(
    409,
    "Target unreachable",
    "No sequence of this camera reaches the target on this scene within the budget. `field` names "
    "what is out of reach, `limit` the best value within reach, `best` the sequence that "
    "achieves it, and `limited_by` what limits it: `bias`, `noise`, `budget` or `together`.",
)
INTERNAL_ERROR: Final = ProblemKind(
    500,
    "Internal error",
    "This is an error of the service, not of the request; its log has the details.",
)
RECORDING_NOT_STORED: Final = ProblemKind(
    507,
    "Recording cannot be stored",
    "The disk is full or read-only, or the service has no permission to write there. The camera "
    "goes on capturing.",
)
CALIBRATION_NOT_STORED: Final = ProblemKind(
    507,
    "Calibration cannot be stored",
    "The disk is full or read-only, the service has no permission to write there, or as many "
    "calibrations are stored as calibrations.max_count allows.",
)
PRODUCT_FAILED: Final = ProblemKind(
    500,
    "Product computation failed",
    "Computing this product of this frame failed. Other products and other frames are not "
    "affected; the service's log has the details.",
)
CAMERA_FAILED: Final = ProblemKind(
    502, "Camera error", "The camera answered the command with an error."
)
CAMERA_LOST: Final = ProblemKind(
    503,
    "Camera not connected",
    "The camera was unplugged or does not answer. The service searches for it and resumes by "
    "itself when it is back.",
)
LIGHT_UNCONFIRMED: Final = ProblemKind(
    504,
    "The light may be on",
    "The service that is relayed has not confirmed in time that its light is off. The request is "
    "sent there again until it does, or somebody starts the capture; `switching_off` of `GET "
    "/api/v1/acquisition` is true until then.",
)
DISK_STALLED: Final = ProblemKind(
    503,
    "Disk does not answer",
    "Where recordings are kept, nothing was read or written for `limit` seconds, as of a disk on a "
    "network that is gone. What was begun is done once the disk answers; capture goes on.",
)
STORE_GONE: Final = ProblemKind(
    410,
    "Not there any more",
    "The data of this key are not there: what they were of was deleted, or is another one than "
    "when its metadata were read. It is not 404, which readers of Zarr take for zeros. Open it "
    "anew.",
)
NO_FRAME_YET: Final = ProblemKind(
    503,
    "No frame yet",
    "No frame was captured since the service started, or none newer than the requested one. "
    "`wait_s` lets the request wait for it.",
)
NOT_READY: Final = ProblemKind(
    503, "Not ready", "The camera delivers no frames; `reasons` states why."
)
SHUTTING_DOWN: Final = ProblemKind(503, "Service shutting down", "Connect again in a while.")
TOO_MANY_CLIENTS: Final = ProblemKind(
    503,
    "Too many stream clients",
    "As many clients as the setting stream.max_clients allows are connected. The stream closes "
    "with code 1013.",
)
SUBPROTOCOL_REQUIRED: Final = ProblemKind(
    400,
    "Subprotocol required",
    "The WebSocket handshake must offer the subprotocol that `supported` names.",
)
BAD_MESSAGE: Final = ProblemKind(
    422,
    "Invalid message",
    "`field` names the part of the message, `value` repeats it and `limit` states what is "
    "possible. The stream closes with code 4001 if it was the first message, and carries on "
    "otherwise.",
)
TOO_MANY_MESSAGES: Final = ProblemKind(
    429,
    "Too many messages",
    "The client of a stream sent more messages a second than stream.max_messages_hz (`limit`) "
    "allows beside one for each frame. The stream closes with code 4008.",
)
FIRST_MESSAGE_LATE: Final = ProblemKind(
    408,
    "Subscription timeout",
    "The first message of a stream must be a subscription and arrive within `limit` seconds.",
)

KINDS: Final[dict[str, ProblemKind]] = {}
"""Every kind by its slug."""
for _name, _kind in list(globals().items()):
    if isinstance(_kind, ProblemKind):
        object.__setattr__(_kind, "slug", _name.lower().replace("_", "-"))
        KINDS[_kind.slug] = _kind
