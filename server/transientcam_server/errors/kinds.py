"""Every kind of problem this service answers with, each with a page of its own."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem: the last part of its type URI, its HTTP status, and what it means."""

    slug: str
    status: int
    title: str
    meaning: str

    @property
    def type(self) -> str:
        """The URI that identifies the kind; the service answers it with a page."""
        return f"/problems/{self.slug}"


BAD_REQUEST: Final = ProblemKind(
    "bad-request", 400, "The request cannot be understood", "The request is not valid HTTP or JSON."
)
HOST_NOT_ALLOWED: Final = ProblemKind(
    "host-not-allowed",
    403,
    "This name is not served",
    "The Host header names none of the hosts this service answers to. It protects a service on "
    "the loopback interface from pages that rebind their own name to it. Add the name to the "
    "setting allowed_hosts.",
)
ORIGIN_NOT_ALLOWED: Final = ProblemKind(
    "origin-not-allowed",
    403,
    "Pages of this origin may not control the camera",
    "A page of another site tried to change something or to open the stream. Add its origin to "
    "the setting allowed_origins if that is meant.",
)
TOKEN_REQUIRED: Final = ProblemKind(
    "token-required",
    401,
    "Who are you?",
    "This service can be reached from other machines and so asks everybody for a token: in the "
    "header Authorization (Bearer) or X-API-Key, or on the stream in the first message. "
    "`transientcam token create` makes one. The stream closes with code 4003.",
)
TOKEN_REFUSED: Final = ProblemKind(
    "token-refused",
    401,
    "This token is not valid here",
    "The token is unknown, was revoked or has expired. The stream closes with code 4003.",
)
ROLE_TOO_LOW: Final = ProblemKind(
    "role-too-low",
    403,
    "This token may not do that",
    "The token's role (`value`) may look, but not do this; `limit` is the role it takes.",
)
NOT_FOUND: Final = ProblemKind(
    "not-found", 404, "There is nothing here", "No resource has this path. /docs lists all of them."
)
UNKNOWN_PRODUCT: Final = ProblemKind(
    "unknown-product",
    404,
    "This camera has no such product",
    "The product is not among those a frame of this camera has; `known` lists them. `truth` "
    "exists only where the camera is simulated.",
)
NOT_SIMULATED: Final = ProblemKind(
    "not-simulated",
    404,
    "The camera is a real one",
    "The request is about the simulated world behind a simulated camera, and this camera has none.",
)
UNKNOWN_RECORDING: Final = ProblemKind(
    "unknown-recording",
    404,
    "There is no such recording",
    "No recording has this id; the list of recordings has those there are.",
)
UNKNOWN_CALIBRATION: Final = ProblemKind(
    "unknown-calibration",
    404,
    "There is no such calibration",
    "No calibration has this id; the list of calibrations has those there are.",
)
UNKNOWN_JOB: Final = ProblemKind(
    "unknown-job",
    404,
    "There is no such job",
    "No job has this id. Jobs that have ended are forgotten after a while.",
)
UNKNOWN_FRAME: Final = ProblemKind(
    "unknown-frame",
    404,
    "There is no such frame yet",
    "No frame has this number; `first` and `last` say which can be had. `wait_s` lets the request "
    "wait for one that is still to come.",
)
FRAME_GONE: Final = ProblemKind(
    "frame-gone",
    410,
    "The frame is not kept any more",
    "Raw frames are kept for the settings history.seconds and history.max_bytes; `first` and "
    "`last` say which can still be had. What is to stay longer has to be recorded.",
)
METHOD_NOT_ALLOWED: Final = ProblemKind(
    "method-not-allowed",
    405,
    "The method does not apply here",
    "The path exists, but not for this method; the Allow header lists those that do.",
)
NOT_ACCEPTABLE: Final = ProblemKind(
    "not-acceptable",
    406,
    "The product has no such format",
    "Neither the suffix nor the Accept header names a format this product has; `supported` lists "
    "them. Only products with one value a pixel can be a PNG.",
)
LEASE_HELD: Final = ProblemKind(
    "lease-held",
    409,
    "Somebody else controls the camera",
    "While somebody holds the lease, only requests that name it in the header Transientcam-Lease "
    "change anything. `holder` says who it is and `expires_in_s` how long the lease lasts unless "
    "it is renewed. Watching needs no lease.",
)
LEASE_LOST: Final = ProblemKind(
    "lease-lost",
    409,
    "This lease is over",
    "The lease that the header Transientcam-Lease names was given back, taken over or not renewed "
    "in time. `holder` says who has one now. Nothing was changed.",
)
RECORDING_RUNS: Final = ProblemKind(
    "recording-runs",
    409,
    "There is a recording already",
    "One recording runs at a time; `recording` is its id. Stop it first.",
)
RECORDING_UNFINISHED: Final = ProblemKind(
    "recording-unfinished",
    409,
    "The recording is not finished",
    "It is still being written, or its writer died and it was not recovered yet; the service "
    "recovers such ones when it starts.",
)
CALIBRATION_MISFIT: Final = ProblemKind(
    "calibration-misfit",
    409,
    "The calibration is not good for this",
    "A calibration is good for the camera, the sequence and the exposure that it was measured "
    "with. `field` names what differs, `value` what is there and `limit` what it is good for. "
    "Frames go on as they were.",
)
ESTIMATOR_MISFIT: Final = ProblemKind(
    "estimator-misfit",
    409,
    "The estimator needs more harmonics",
    "The estimator that the reconstruction takes the range from needs more harmonics than the "
    "sequence has. `field` names what does not go together with the other, `value` what was asked "
    "for and `limit` what would do. Frames go on as they were, but for the products that rest on "
    "the estimator.",
)
CALIBRATION_IN_USE: Final = ProblemKind(
    "calibration-in-use",
    409,
    "The calibration is in use",
    "It is the active one, or the one that the service was started with. Activate another one, or "
    "`nominal`, before deleting it.",
)
CAMERA_BUSY: Final = ProblemKind(
    "camera-busy",
    409,
    "The camera is being calibrated",
    "A job has the camera for itself until it has ended; `job` is its id. Cancel it, or wait for "
    "it. Switching the light off is possible meanwhile, and ends it.",
)
RECORDING_DAMAGED: Final = ProblemKind(
    "recording-damaged",
    409,
    "The recording is damaged",
    "The file, or this frame of it, is not what was written. Other frames may be whole.",
)
REQUEST_LATE: Final = ProblemKind(
    "request-late",
    408,
    "The request took too long to arrive",
    "Its head or its body was not complete within `limit` seconds; see limits.head_s and "
    "limits.body_s. The connection is closed.",
)
SEQUENCE_CHANGED: Final = ProblemKind(
    "sequence-changed",
    412,
    "Somebody else has changed the sequence",
    "The request was about the sequence that If-Match names, which is not the running one any "
    "more. `value` repeats the tag, `current` is that of the running one. Nothing was changed.",
)
RECONSTRUCTION_CHANGED: Final = ProblemKind(
    "reconstruction-changed",
    412,
    "Somebody else has changed the reconstruction",
    "The request was about the settings that If-Match names, which are not in use any more. "
    "`value` repeats the tag, `current` is that of those in use. Nothing was changed.",
)
HEAD_TOO_LARGE: Final = ProblemKind(
    "head-too-large",
    431,
    "The head of the request is too large",
    "Request line and headers together are longer than `limit` bytes; see limits.head_bytes.",
)
TOO_MANY_JOBS: Final = ProblemKind(
    "too-many-jobs",
    429,
    "Too many jobs",
    "`limit` jobs run or wait already. Cancel one, or try again when one has ended.",
)
TOO_MANY_FROM_ONE_ADDRESS: Final = ProblemKind(
    "too-many-from-one-address",
    429,
    "Too many connections from one address",
    "As many connections as limits.max_connections_per_address allows are open from there.",
)
TOO_MANY_CONNECTIONS: Final = ProblemKind(
    "too-many-connections",
    503,
    "Too many connections",
    "As many connections as limits.max_connections allows are open. Try again in a while.",
)
TOO_LARGE: Final = ProblemKind(
    "too-large", 413, "The request is too large", "The body is longer than `limit` bytes."
)
RANGE_NOT_SATISFIABLE: Final = ProblemKind(
    "range-not-satisfiable",
    416,
    "The file has no such bytes",
    "The Range header asks for bytes beyond the end of the file, whose size `limit` states.",
)
INVALID_REQUEST: Final = ProblemKind(
    "invalid-request",
    422,
    "A value of the request cannot be used",
    "`field` names the value, `value` repeats it and `limit` says what would do. `errors` lists "
    "all of them where there are several. Nothing was changed.",
)
INVALID_SEQUENCE: Final = ProblemKind(
    "invalid-sequence",
    422,
    "The camera cannot run this sequence",
    "`field` of the sequence is out of the range of this camera, which `limit` states. The "
    "sequence that was running before is still running.",
)
INVALID_CALIBRATION: Final = ProblemKind(
    "invalid-calibration",
    422,
    "This is no calibration",
    "The file cannot be read as one that this service or `transientcam calibrate` has written. "
    "`field` names the part that is wrong, `value` what it is and `limit` what it should be.",
)
ANSWER_TOO_LARGE: Final = ProblemKind(
    "answer-too-large",
    422,
    "The answer would be too large",
    "The product at this many times of flight would exceed the limit on one answer. Ask for "
    "fewer times, or take `coefficients` and evaluate them where they are needed.",
)
TARGET_UNREACHABLE: Final = ProblemKind(
    "target-unreachable",
    422,
    "No sequence reaches this",
    "No sequence of this camera reaches the target on this scene within the budget. `field` names "
    "what is out of reach, `limit` the best that is not, and `best` the sequence that achieves it.",
)
INTERNAL_ERROR: Final = ProblemKind(
    "internal-error",
    500,
    "The service failed",
    "This is a mistake of the service, not of the request; its log says more.",
)
RECORDING_NOT_STORED: Final = ProblemKind(
    "recording-not-stored",
    507,
    "The recording cannot be stored",
    "The disk is full, read-only, or not allowed to the service. The camera goes on capturing.",
)
CALIBRATION_NOT_STORED: Final = ProblemKind(
    "calibration-not-stored",
    507,
    "The calibration cannot be stored",
    "The disk is full, read-only or not allowed to the service, or as many calibrations are "
    "stored as calibrations.max_count allows.",
)
PRODUCT_FAILED: Final = ProblemKind(
    "product-failed",
    500,
    "The product could not be computed",
    "Computing this product of this frame failed. Other products and other frames are not "
    "affected; the service's log says more.",
)
CAMERA_FAILED: Final = ProblemKind(
    "camera-failed", 502, "The camera refused", "The camera answered the command with an error."
)
CAMERA_LOST: Final = ProblemKind(
    "camera-lost",
    503,
    "The camera is not connected",
    "The camera was unplugged or does not answer. The service looks for it and carries on by "
    "itself when it is back.",
)
NO_FRAME_YET: Final = ProblemKind(
    "no-frame-yet",
    503,
    "There is no such frame yet",
    "No frame was captured since the service started, or none newer than the one asked for. "
    "`wait_s` lets the request wait for it.",
)
NOT_READY: Final = ProblemKind(
    "not-ready", 503, "The camera delivers no frames", "`reasons` says why."
)
SHUTTING_DOWN: Final = ProblemKind(
    "shutting-down", 503, "The service shuts down", "Connect again in a while."
)
TOO_MANY_CLIENTS: Final = ProblemKind(
    "too-many-clients",
    503,
    "The stream is fully booked",
    "As many clients as the setting stream.max_clients allows are connected. The stream closes "
    "with code 1013.",
)
SUBPROTOCOL_REQUIRED: Final = ProblemKind(
    "subprotocol-required",
    400,
    "The stream speaks one subprotocol",
    "The WebSocket handshake must offer the subprotocol that `supported` names.",
)
BAD_MESSAGE: Final = ProblemKind(
    "bad-message",
    422,
    "A message of the stream cannot be used",
    "`field` names the part of the message, `value` repeats it and `limit` says what would do. "
    "The stream closes with code 4001 if it was the first message, and carries on otherwise.",
)
TOO_MANY_MESSAGES: Final = ProblemKind(
    "too-many-messages",
    429,
    "Too many messages",
    "The client of a stream sent more messages a second than stream.max_messages_hz (`limit`) "
    "allows beside one for each frame. The stream closes with code 4008.",
)
FIRST_MESSAGE_LATE: Final = ProblemKind(
    "first-message-late",
    408,
    "No subscription arrived",
    "The first message of a stream must be a subscription and arrive within `limit` seconds.",
)

KINDS: Final[dict[str, ProblemKind]] = {
    kind.slug: kind for kind in list(globals().values()) if isinstance(kind, ProblemKind)
}
"""Every kind by its slug."""
