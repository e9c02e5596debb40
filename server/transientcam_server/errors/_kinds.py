"""Every kind of problem this service answers with, each with a page of its own."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem: its HTTP status, what it means, and the last part of its type URI."""

    status: int
    title: str
    meaning: str
    slug: str

    @property
    def type(self) -> str:
        """The URI that identifies the kind; the service answers it with a page."""
        return f"/problems/{self.slug}"


_TEXTS: Final = tomllib.loads(Path(__file__).with_name("kinds.toml").read_text("utf-8"))
KINDS: Final = {slug: ProblemKind(slug=slug, **texts) for slug, texts in _TEXTS.items()}
"""Every kind by its slug."""

BAD_REQUEST: Final = KINDS["bad-request"]
HOST_NOT_ALLOWED: Final = KINDS["host-not-allowed"]
ORIGIN_NOT_ALLOWED: Final = KINDS["origin-not-allowed"]
TOKEN_REQUIRED: Final = KINDS["token-required"]
TOKEN_REFUSED: Final = KINDS["token-refused"]
ROLE_TOO_LOW: Final = KINDS["role-too-low"]
MAY_NOT_LIGHT: Final = KINDS["may-not-light"]
NOT_FOUND: Final = KINDS["not-found"]
UNKNOWN_PRODUCT: Final = KINDS["unknown-product"]
NOT_SIMULATED: Final = KINDS["not-simulated"]
ONLY_MOMENTS: Final = KINDS["only-moments"]
UNKNOWN_RECORDING: Final = KINDS["unknown-recording"]
UNKNOWN_PRODUCT_STORE: Final = KINDS["unknown-product-store"]
UNKNOWN_CALIBRATION: Final = KINDS["unknown-calibration"]
UNKNOWN_JOB: Final = KINDS["unknown-job"]
UNKNOWN_FRAME: Final = KINDS["unknown-frame"]
FRAME_GONE: Final = KINDS["frame-gone"]
METHOD_NOT_ALLOWED: Final = KINDS["method-not-allowed"]
NOT_ACCEPTABLE: Final = KINDS["not-acceptable"]
LEASE_HELD: Final = KINDS["lease-held"]
LEASE_LOST: Final = KINDS["lease-lost"]
RECORDING_RUNS: Final = KINDS["recording-runs"]
RECORDING_UNFINISHED: Final = KINDS["recording-unfinished"]
PRODUCT_STORE_UNFINISHED: Final = KINDS["product-store-unfinished"]
CALIBRATION_MISFIT: Final = KINDS["calibration-misfit"]
CALIBRATION_DOUBTED: Final = KINDS["calibration-doubted"]
NO_FORMER_CALIBRATION: Final = KINDS["no-former-calibration"]
ESTIMATOR_MISFIT: Final = KINDS["estimator-misfit"]
CALIBRATION_IN_USE: Final = KINDS["calibration-in-use"]
CAMERA_BUSY: Final = KINDS["camera-busy"]
START_OUTDATED: Final = KINDS["start-outdated"]
RECORDING_DAMAGED: Final = KINDS["recording-damaged"]
REQUEST_LATE: Final = KINDS["request-late"]
SEQUENCE_CHANGED: Final = KINDS["sequence-changed"]
RECONSTRUCTION_CHANGED: Final = KINDS["reconstruction-changed"]
HEAD_TOO_LARGE: Final = KINDS["head-too-large"]
TOO_MANY_JOBS: Final = KINDS["too-many-jobs"]
TOO_MANY_FROM_ONE_ADDRESS: Final = KINDS["too-many-from-one-address"]
TOO_MANY_CONNECTIONS: Final = KINDS["too-many-connections"]
TOO_MANY_ANSWERS: Final = KINDS["too-many-answers"]
PLANNING_BUSY: Final = KINDS["planning-busy"]
PLANNING_ENDED: Final = KINDS["planning-ended"]
PLAN_TOO_LONG: Final = KINDS["plan-too-long"]
TOO_LARGE: Final = KINDS["too-large"]
RANGE_NOT_SATISFIABLE: Final = KINDS["range-not-satisfiable"]
INVALID_REQUEST: Final = KINDS["invalid-request"]
INVALID_SEQUENCE: Final = KINDS["invalid-sequence"]
INVALID_RECORDING: Final = KINDS["invalid-recording"]
INVALID_CALIBRATION: Final = KINDS["invalid-calibration"]
ANSWER_TOO_LARGE: Final = KINDS["answer-too-large"]
TARGET_UNREACHABLE: Final = KINDS["target-unreachable"]
INTERNAL_ERROR: Final = KINDS["internal-error"]
RECORDING_NOT_STORED: Final = KINDS["recording-not-stored"]
CALIBRATION_NOT_STORED: Final = KINDS["calibration-not-stored"]
PRODUCT_FAILED: Final = KINDS["product-failed"]
CAMERA_FAILED: Final = KINDS["camera-failed"]
CAMERA_LOST: Final = KINDS["camera-lost"]
LIGHT_UNCONFIRMED: Final = KINDS["light-unconfirmed"]
DISK_STALLED: Final = KINDS["disk-stalled"]
STORE_GONE: Final = KINDS["store-gone"]
NO_FRAME_YET: Final = KINDS["no-frame-yet"]
NOT_READY: Final = KINDS["not-ready"]
SHUTTING_DOWN: Final = KINDS["shutting-down"]
TOO_MANY_CLIENTS: Final = KINDS["too-many-clients"]
SUBPROTOCOL_REQUIRED: Final = KINDS["subprotocol-required"]
BAD_MESSAGE: Final = KINDS["bad-message"]
TOO_MANY_MESSAGES: Final = KINDS["too-many-messages"]
FIRST_MESSAGE_LATE: Final = KINDS["first-message-late"]
