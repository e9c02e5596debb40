"""The JSON documents about the camera, and whether it captures."""

from typing import Any, Literal

from pydantic import Field

from transientcam.documents import ExtrinsicsDocument
from transientcam_server.api._documents.document import Document, RequestDocument
from transientcam_server.camera import Cause, State


class CameraDocument(Document):
    """The camera: what it can do, and how it is."""

    class IntrinsicsDocument(Document):
        """A pinhole camera, in pixels; whole numbers are the centres of pixels."""

        fx: float
        fy: float
        cx: float
        cy: float
        width: int
        height: int
        distortion: tuple[float, ...]
        """k1, k2, p1, p2, k3 of Brown and Conrady, which OpenCV has in this order; or none."""
        light_x_m: float
        """How far to the right of the lens the light is."""
        light_y_m: float
        """How far below it."""
        light_z_m: float
        """How far before it."""
        beam: tuple[float, ...]
        """Its axis x, y, z, the power of the cosine to it that it falls with, and how bright in DN,
        for a second of exposure, a white surface is that faces it at 1 m; or none."""
        extrinsics: ExtrinsicsDocument | None = None
        """Null where nobody says where the camera is mounted."""
        source: Literal["settings", "camera", "scene", "recording", "origin", "assumed"]
        """Its origin: the settings `[lens]`, the camera itself, the simulated scene, the recording,
        the origin of a relay, or none."""

    class SensorDocument(Document):
        """The sensor, which predictions of noise rest on."""

        gain_e_per_dn: float
        """Electrons a digital number stands for."""
        full_well_e: float
        """Electrons that a pixel holds."""
        read_noise_e: float
        """Standard deviation of a read-out, in electrons."""
        dark_dn: float
        """What the converter gives for an empty pixel."""
        bits: int

    class OriginDocument(Document):
        """The service that this one relays, and what was missed on the way from there."""

        url: str
        service_id: str
        version: str
        role: Literal["viewer", "operator", "admin"]
        """What this relay may do there; a viewer's token changes nothing."""
        product: Literal["raw", "measured_moments"]
        """What comes from there: images, or their moments alone."""
        missed_frames: int
        """Frames that the origin captured and this relay never got, since it began; those across a
        restart of the origin are not known."""
        dropped_frames: int
        """Those of them that the origin dropped because relay or network were too slow."""
        reconnects: int
        """How often the origin was found again."""
        restarts: int
        """How often it was started anew meanwhile."""

    state: State
    reason: str | None = None
    """Why it is lost, or its light is off."""
    simulated: bool
    light_warning: str | None = None
    """Of a camera without a watchdog of its own: what switches its light off when this service
    fails, and what does not; null where the camera does so by itself, or has no light here."""
    capabilities: dict[str, Any]
    """As the camera itself states them; units are in the names."""
    intrinsics: IntrinsicsDocument
    """Where the pixels look: (column, row) along ((c - cx) / fx, (r - cy) / fy, 1), but for the
    distortion."""
    sensor: SensorDocument | None
    """As it is stated; null where nobody does, and the images of each frame tell their noise."""
    origin: OriginDocument | None = None
    """Of a relay (docs/relay.md); null where the camera is at this service."""
    status: dict[str, Any] | None = None
    """As the camera itself states it now; null while it is lost."""
    counters: dict[str, int]
    """What was received since the service started."""


class AcquisitionDocument(Document):
    """Whether frames are captured, and how fast."""

    running: bool
    state: State
    reason: str | None = None
    """Why the camera is lost, or its light is off or may be on."""
    rate_hz: float | None = None
    """Measured over the last frames; null before there are two."""
    frames: int
    """Captured since the service started."""
    frame_age_s: float
    """Since the last frame arrived."""
    stalled: bool
    """Whether no frame arrived for much longer than one takes."""
    light_on_in_s: float | None = None
    """Time until the light goes on, while `state` is `arming`; null else."""
    off_because: Cause | None = None
    """What ended the capture: `stop`, `safe-off`, `lapse` of a lease, the `device` (its interlock),
    that it was `unused` or clients `unserved`, or the `supervisor` beside this service; or why none
    began: `start`, where the service starts none by itself, and where what is kept of the light is
    `unreadable` or `unwritable`. Null while it is running, and of a relay."""
    off_kept: bool | None = None
    """Whether the light stays off over a restart of the service; false while the disk has not taken
    it. Null while the capture is running, and of a relay."""
    offs: int
    """Counts how often the light was to go off, from a number drawn when the service starts."""
    switching_off: bool
    """Whether the light was to go off and may still be on: a relay's origin has not confirmed it,
    and is asked again until it does."""


class AcquisitionRequest(
    RequestDocument, strict=True, json_schema_extra={"examples": [{"running": False}]}
):
    """What the acquisition should do."""

    running: bool
    """Whether frames are captured; the light is off while they are not, and starts with a delay
    after it was announced. Starting takes the right `may_light`."""
    offs: int | None = None
    """Refuse a start, with `start-outdated`, where the acquisition's `offs` is another number by
    now; without it, where it has changed since the request arrived."""


class CameraChangeDocument(
    RequestDocument, strict=True, json_schema_extra={"examples": [{"camera": "sim:corner"}]}
):
    """Which camera is to be served next."""

    camera: str
    """Its name, as the setting `camera` has it: one of the choices, or `none`."""


class CameraChoicesDocument(Document):
    """The camera that is served, and those that could be in its place."""

    current: str
    """Its name; `none` while there is none."""
    cameras: list[dict[str, Any]]
    """At this machine and on the network: `spec` opens it, unless there is a `problem`."""
    simulated: list[str]
    """Simulations, which are always there."""
    kinds: list[dict[str, Any]]
    """What can be opened, one a plug-in: `name`, `usage`, `summary`, `options`."""
    problems: dict[str, str]
    """Why a kind could not look for its cameras."""
    missing: list[dict[str, Any]]
    """What this machine lacks, as `transientcam doctor` finds it: `check`, `message`, `remedy`."""


class NeighboursDocument(Document):
    """The cameras that announce themselves on the local network by mDNS.

    Everything in it is what they announce: no request was sent to any of them.
    """

    class NeighbourDocument(Document):
        """The service of a camera, as it announces itself."""

        name: str = Field(description="unique on the network")
        url: str
        """Of its dashboard, and what clients take as its address."""
        model: str
        serial: str
        firmware: str
        api: str = Field(description="versions of its interface")
        tls: bool
        state: Literal["", "arming", "starting", "streaming", "stopped", "calibrating", "lost"]
        """What its camera does; empty where that is not announced."""
        seen_s: float = Field(ge=0.0, description="since it answered, in s")

    cameras: list[NeighbourDocument] = Field(max_length=256)
    left_out: int = Field(ge=0, description="how many more were announced")
    reason: str | None = Field(default=None, description="why the network could not be searched")
