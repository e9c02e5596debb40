"""The settings of the service; `transientcam_server.daemon._configuration` reads them."""

import os
from collections.abc import Callable, Mapping
from functools import cache
from ipaddress import ip_address
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    Self,
    TypeVar,
    get_args,
    get_type_hints,
)

from platformdirs import user_config_path, user_data_path
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

import transientcam_moments as tm
from transientcam.documents import Neighbours
from transientcam.wire import FIRST_MESSAGE_WITHIN_S, MAX_SUBSCRIPTIONS
from transientcam_compiled import cores
from transientcam_moments.comparisons import PLUGINS, TECHNIQUES
from transientcam_moments.reconstruction import ESTIMATORS, least_harmonics

_DEFAULTS = tm.Settings()
_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Read = TypeVar("_Read")
_reader_of: Callable[..., TypeAdapter[Any]] = cache(TypeAdapter)


def no_switch_for_a_number(model: type[BaseModel], value: object, info: ValidationInfo) -> object:
    """Refuse true and false where a number is due: pydantic takes them for 1 and 0."""
    if _is_misread(model.model_fields[str(info.field_name)].annotation, value):
        raise PydanticCustomError("number", "Input should be a number, not true or false")
    return value


def dataclass_of(kind: type[_Read], document: object) -> _Read:
    """Return what a document of a file or of another service stands for, or raise a ValueError."""
    expected = get_type_hints(kind)
    if not isinstance(document, Mapping):
        raise ValueError(f"{document!r} is no object")
    for name, value in document.items():
        if _is_misread(expected.get(name), value):
            raise ValueError(f"{name} is {value!r}, but must be a number")
    read: _Read = _reader_of(kind).validate_python(document)
    return read


def _is_misread(annotation: Any, value: object) -> bool:
    return _holds(annotation, int, float) and not _holds(annotation, bool) and has_switch(value)


def has_switch(value: object) -> bool:
    """Return whether true or false stands anywhere in a value of JSON."""
    left = [value]
    while left:
        each = left.pop()
        if isinstance(each, bool):
            return True
        if isinstance(each, list | tuple | Mapping):
            left += each.values() if isinstance(each, Mapping) else each
    return False


def _holds(annotation: Any, *wanted: type) -> bool:
    return annotation in wanted or any(_holds(each, *wanted) for each in get_args(annotation))


class _Group(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)
    _numbers = field_validator("*", mode="before")(classmethod(no_switch_for_a_number))


if TYPE_CHECKING:
    Estimator = str
else:
    # a closed set for pydantic and OpenAPI: those that keep up with a camera, all pixels at once;
    # the others are for recordings, through the library
    Estimator = Literal[
        (
            "automatic",
            *(name for name in ESTIMATORS if name not in TECHNIQUES or TECHNIQUES[name].planar),
        )
    ]


def _or_plugged(name: Any, known: ValidatorFunctionWrapHandler) -> Any:
    """Take the name of another package's estimator, too."""
    try:
        return name if isinstance(name, str) and name in PLUGINS.names() else known(name)
    except ValidationError as error:
        also = "".join(f", {each!r} of another package" for each in PLUGINS.names())
        listed = {"expected": f"{error.errors()[0].get('ctx', {})['expected']}{also}"}
        raise PydanticCustomError("literal_error", "Input should be {expected}", listed) from None


def _with_plugged(schema: dict[str, Any]) -> None:
    schema["enum"] = [*schema["enum"], *PLUGINS.names()]


CorruptImages = Literal["keep", "repair", "fill"]


class SequenceSettings(_Group):
    """What the camera captures from the start, until a client sets something else.

    The default is on the front of accuracy against time (docs/measured/default-sequence.md). A
    camera that cannot do it does what is nearest.
    """

    base_frequency_hz: _Finite = Field(default=23e6, gt=0.0)
    """Modulation frequencies are this and its multiples."""
    harmonics: int = Field(default=4, ge=1, le=32)
    """m: how many multiples."""
    zeroth: Literal["low-frequency", "on-off", "estimated"] = "estimated"
    """Where the zeroth moment comes from; costs four, two or no images (Sec. 4.3)."""
    exposure_s: _Finite = Field(default=0.00192, gt=0.0)
    """Of one image."""
    takes: int = Field(default=1, ge=1, le=10_000)
    """How often each image is captured, for averaging."""


class ReconstructionSettings(_Group):
    """How images become moments and moments become returns."""

    neighbours: Neighbours = "edge-preserving"
    """How moments are averaged over neighbouring pixels. `edge-preserving` averages up to 69 that
    differ by no more than noise, and none across an edge: the noise falls two to four times further
    than by `gaussian`, which is the paper's, and stands in where the noise is not known, as of
    moments alone; each frame names the one applied. Beyond 8 harmonics and until its kernel is
    compiled it runs in NumPy, more slowly."""
    still_frames: int = Field(default=1, ge=1, le=tm.noise.MOST_FRAMES)
    """How many frames of a stream are averaged, at most, in each pixel that stands still; 1 for
    none. A pixel begins anew in the frame in which it changes by more than noise, or has drifted:
    the noise falls with the square root of `frames_averaged`. It needs the noise of the sensor, or
    images that tell it. Frames of recordings are never averaged."""
    smoothing_px: _Finite = Field(default=_DEFAULTS.smoothing_sigma_px, ge=0.0, le=10.0)
    """Standard deviation of the Gaussian that smooths the moments, in pixels; 0 for none."""
    bias: _Finite = Field(default=_DEFAULTS.epsilon, ge=1e-6, le=0.99)
    """Smallest eigenvalue every pixel's moments are raised to, over its brightness (Sec. 4.3)."""
    return_threshold: _Finite = Field(default=_DEFAULTS.threshold, ge=0.0, le=1.0)
    """Weight from which a return counts as the first, over the pixel's strongest return."""
    least_range_m: _Finite = Field(default=_DEFAULTS.least_range_m, ge=-1000.0, le=1000.0)
    """The sensor's: what is nearer is taken for what is one unambiguous range farther. For 0 strong
    light in the last 64th of that is below 0: noise puts nothing at 0 m to the far end."""
    estimator: Annotated[Estimator, WrapValidator(_or_plugged)] = Field(
        default="automatic", json_schema_extra=_with_plugged
    )
    """What range, direct and indirect light are taken from. `automatic` is `likelihood`, which errs
    least over the scenes of docs/likelihood.md together; each frame names its `estimator`. The
    paper's are `pisarenko` and `maximum-entropy`. `likelihood`, `two-returns` and `unwrapped-phase`
    serve any set of frequencies; for those with gaps `automatic` is `two-returns`, or
    `unwrapped-phase` where there are but two. The others are there for comparison; what those of
    other packages state of themselves is in `estimators` of `GET /api/v1/info`. Until its kernel is
    compiled the same estimator runs in NumPy, more slowly."""
    minimum_brightness_dn: _Finite = Field(default=0.0, ge=0.0)
    """Pixels with no more light than this have no range."""
    spoilt_images: CorruptImages = "repair"
    """Images that lost their synchronisation: rebuilt from the frame's other images, and (`fill`)
    taken from the frame before where that is impossible; or kept."""
    modulation_harmonics: Literal["take-out", "keep"] = "take-out"
    """Odd harmonics of the modulation, where the calibration has measured them: taken out of the
    moments, or kept in them."""

    @classmethod
    def recorded(cls, given: Mapping[str, Any]) -> Self:
        """Return those of a recording; before there was `neighbours` it was a Gaussian."""
        return cls.model_validate({"neighbours": "gaussian", **given})

    @property
    def gaussian_px(self) -> float:
        """Standard deviation of the Gaussian, which stands in for `edge-preserving`; 0 for none."""
        return 0.0 if self.neighbours == "none" else self.smoothing_px

    @property
    def least_harmonics(self) -> int:
        """The smallest number of harmonics that the estimator gives a range of."""
        return least_harmonics(self.estimator)

    def for_moments(self, **others: Any) -> tm.Settings:
        """Return these settings as `tm.Settings`, together with its other ones."""
        return tm.Settings(
            epsilon=self.bias,
            neighbours=self.neighbours,
            still_frames=self.still_frames,
            smoothing_sigma_px=self.smoothing_px,
            threshold=self.return_threshold,
            least_range_m=self.least_range_m,
            estimator=self.estimator,
            minimum_brightness=self.minimum_brightness_dn,
            spoilt_images=self.spoilt_images,
            **others,
        )


class SensorSettings(_Group):
    """The sensor of a real camera, from its data sheet, if any of it is stated: predictions of
    accuracy rest on it. Where nothing is, plans assume these, and the noise of frames is measured
    in their images.
    """

    gain_e_per_dn: _Finite = Field(default=9.0, gt=0.0)
    """Electrons a digital number stands for."""
    full_well_e: _Finite = Field(default=40_000.0, gt=0.0)
    """Electrons that a pixel holds."""
    read_noise_e: _Finite = Field(default=30.0, ge=0.0)
    """Standard deviation of a read-out, in electrons."""
    dark_dn: _Finite = Field(default=64.0, ge=0.0)
    """What the converter gives for an empty pixel."""


class LensSettings(_Group):
    """Where the pixels look and the light is, in place of what camera or scene say of it.

    Point clouds, depth images and what robots are told of the lens rest on it.
    """

    field_of_view_deg: _Finite | None = Field(default=None, gt=0.0, lt=180.0)
    """Horizontal, for square pixels around the axis."""
    fx_px: _Finite | None = Field(default=None, gt=0.0)
    """Focal length in pixels instead, as a calibration of the lens gives it."""
    fy_px: _Finite | None = Field(default=None, gt=0.0)
    """The same in the other direction, where it differs."""
    cx_px: _Finite | None = None
    """Column that the axis goes through; the middle of the frame without it."""
    cy_px: _Finite | None = None
    """Row that the axis goes through."""
    distortion: tuple[_Finite, ...] = ()
    """k1, k2, p1, p2 and k3, as OpenCV has them, beside `fx_px`; none without it."""
    light_x_m: _Finite | None = Field(default=None, ge=-10.0, le=10.0)
    """How far to the right of the lens the light is; also without any other of these."""
    light_y_m: _Finite | None = Field(default=None, ge=-10.0, le=10.0)
    """How far below the lens."""
    light_z_m: _Finite | None = Field(default=None, ge=-10.0, le=10.0)
    """How far before the lens."""
    beam: tuple[_Finite, ...] = ()
    """The beam of the light, as `calibrate --beam` measures it: x, y and z of its axis, the power
    of the cosine to it that it falls with, and how bright in DN, for a second of exposure, a white
    surface is that faces it at 1 m. Ranges of what is brighter are then not trusted."""

    @model_validator(mode="after")
    def _agree(self) -> Self:
        """Refuse what contradicts itself, or would be left out."""
        if self.field_of_view_deg is not None and self.fx_px is not None:
            raise ValueError("field_of_view_deg and fx_px say the same: give one of them")
        beside = ("fy_px", "cx_px", "cy_px", "distortion")
        given = [name for name in beside if getattr(self, name) not in (None, ())]
        if given and self.fx_px is None:
            raise ValueError(f"{' and '.join(given)} must stand beside fx_px")
        if len(self.distortion) not in (0, 5):
            raise ValueError(f"distortion has 5 numbers or none, not {len(self.distortion)}")
        if len(self.beam) not in (0, 5):
            raise ValueError(f"beam has 5 numbers or none, not {len(self.beam)}")
        return self


class StreamSettings(_Group):
    """How many clients may connect, and how far one may fall behind."""

    max_clients: int = Field(default=256, ge=1, le=100_000)
    """Streams open at the same time; one more is refused, to try again later."""
    queue_frames: int = Field(default=2, ge=1, le=16)
    """Frames that wait for one client before the oldest is dropped."""
    first_message_s: _Finite = Field(default=FIRST_MESSAGE_WITHIN_S, gt=0.0, le=300.0)
    """Time a client has to subscribe."""
    max_subscriptions: int = Field(default=MAX_SUBSCRIPTIONS, ge=1, le=MAX_SUBSCRIPTIONS)
    """Products that one client may have at the same time."""
    max_messages_hz: _Finite = Field(default=50.0, ge=1.0, le=100_000.0)
    """WebSocket frames a second that are read of one client, of every kind, beside one for each
    message it was sent; those of two seconds may come at once. Each KiB counts as one more. A
    client that sends more is disconnected."""


class HistorySettings(_Group):
    """How many captured frames are kept; the smaller of both limits counts."""

    seconds: _Finite = Field(default=10.0, ge=0.0, le=3600.0)
    """Raw frames are kept for so long; 0 keeps the latest alone."""
    max_bytes: int = Field(default=256 * 1024**2, ge=0)
    """Their images take no more memory than this."""


NO_HOME: Final = Path("/nonexistent/without-a-home-directory")
"""In the place of the directories of a user that has none: nothing is kept there."""


def _of_user(directory: Callable[[str], Path]) -> Path:
    try:
        return directory("transientcam")
    except RuntimeError:  # a user that no password file knows, without HOME
        return NO_HOME


def default_state_directory() -> Path:
    """Return the state directory: the service manager's, or the user's."""
    state = os.environ.get("STATE_DIRECTORY", "").partition(":")[0]  # systemd
    return Path(state) if state else _of_user(user_data_path)


def default_recordings_directory() -> Path:
    """Return the directory of recordings below the state directory."""
    return default_state_directory() / "recordings"


class LightSettings(_Group):
    """When the light of the camera begins, and when it ends by itself.

    A simulated scene (sim:) or a recording shines at nobody. The emulation of a real device
    captures from the start, too; else it counts as the device.
    """

    delay_s: _Finite | None = Field(default=None, ge=0.0, le=60.0)
    """From the announcement that the light goes on until it does; without it 3 s, and 0 s of a
    camera that shines at nobody."""
    unused_s: _Finite | None = Field(default=None, ge=0.0, le=31_536_000.0)
    """A capture ends that has had no viewer, reader, recording, job or lease for so long; 0 for
    never. Without it 300 s, and never of a camera that shines at nobody."""
    directory: Path = Field(default_factory=lambda: default_state_directory() / "light")
    """Where it is kept that the light was switched off, for the next start."""


class CalibrationSettings(_Group):
    """Where calibrations are kept, and how many."""

    directory: Path = Field(default_factory=lambda: default_state_directory() / "calibrations")
    """Made with the first calibration."""
    max_count: int = Field(default=64, ge=1, le=10_000)
    """No more are kept."""
    max_bytes: int = Field(default=256 * 1024**2, ge=1024)
    """None that is sent here is larger, packed or unpacked."""


class RecordingSettings(_Group):
    """Where recordings are kept, and when one ends by itself."""

    directory: Path = Field(default_factory=default_recordings_directory)
    """Made with the first recording."""
    max_duration_s: _Finite | None = Field(default=None, gt=0.0)
    """No recording lasts longer."""
    max_bytes: int | None = Field(default=None, ge=1)
    """No recording grows larger."""
    min_free_bytes: int = Field(default=1024**3, ge=0)
    """Recordings end when the disk has no more than this left."""
    max_upload_bytes: int = Field(default=2 * 1024**3, ge=0)
    """None that is sent here is larger, also as it is written anew."""
    queue_bytes: int = Field(default=256 * 1024**2, ge=0)
    """Frames that wait for the disk before some are dropped."""
    stalled_s: _Finite = Field(default=5.0, gt=0.0, le=3600.0)
    """Requests that wait so long for a disk that does nothing are refused."""


class LimitSettings(_Group):
    """What one client may use of the service, so that the others are served, too."""

    max_connections: int = Field(default=512, ge=1, le=100_000)
    """Connections open at the same time, streams included."""
    max_connections_per_address: int = Field(default=256, ge=1, le=100_000)
    """The same, of one address; a proxy is one address."""
    max_connects_hz: _Finite = Field(default=100.0, gt=0.0, le=1e6)
    """New connections a second from one address; max_connections_per_address may come at once."""
    address_share: _Finite = Field(default=0.15, gt=0.0, le=1.0)
    """Of the processor time of the event loop's thread: what answering one address may take while
    frames are sent or recorded. Nothing is refused; its next request is read later."""
    unserved_s: _Finite = Field(default=1.0, ge=0.5, le=60.0)
    """Time without any client being served, after which the capture ends: no client could switch
    the light off meanwhile. After the same time without the camera's thread the supervisor, a
    process of its own, ends it. A camera that shines at nobody (sim:) goes on."""
    plan_s: _Finite = Field(default=300.0, gt=0.0, le=86400.0)
    """Time for a plan, or a look at the scene, to be computed; then it is given up."""
    estimator_s: _Finite = Field(default=2.0, gt=0.0, le=3600.0)
    """Time for an estimator of another package to compute a frame; then its process is ended."""
    head_s: _Finite = Field(default=10.0, gt=0.0, le=3600.0)
    """Time for the head of a request to arrive, and for a handshake of TLS."""
    body_s: _Finite = Field(default=30.0, gt=0.0, le=3600.0)
    """Time for its body, of a file for each MiB."""
    answers_bytes: int = Field(default=48 * 1024**2, ge=1024**2)
    """Of answers on their way to clients, together; one more is refused, to try again later."""
    answers_bytes_per_address: int = Field(default=24 * 1024**2, ge=1024**2)
    """The same, of one address; a single answer may be larger."""
    stalled_s: _Finite = Field(default=20.0, gt=0.0, le=3600.0)
    """Time for a client to take anything of what waits for it; then its connection is cut."""
    head_bytes: int = Field(default=128 * 1024, ge=1024, le=16 * 1024 * 1024)
    """Length of request line and headers; the line alone may have 64 KiB whatever this is. What is
    sent beside a body in chunks may have as much more than the body."""


class Settings(_Group):
    """Everything that can be set."""

    camera: str = Field(default="sim:mirrors", min_length=1)
    """Which camera, as NAME:ADDRESS: ``usb:SERIAL``, ``sim:SCENE``, ``tofcam660:ADDRESS``,
    ``recording:FILE``, or one of another package, as `transientcam devices` lists them; or
    ``none``, to choose one later. One that cannot be opened is waited for."""
    capture_at_start: bool | None = None
    """Capture from the start, unless the light was switched off before; without it only a camera
    does so that is simulated, emulated or replayed. A relay does what its origin does."""
    host: str = Field(default="127.0.0.1", min_length=1)
    """Address to listen on."""
    port: int = Field(default=8000, ge=0, le=65535)
    """TCP port to listen on; 0 takes any free one."""
    root_path: str = Field(default="", pattern=r"^(/[A-Za-z0-9._~-]+)*$", max_length=200)
    """Path below which a proxy serves this, as in ``/lidar``, whether it takes it off or not."""
    announce: Literal["auto", "on", "off"] = "auto"
    """Announce the service on the local network (mDNS); ``auto``: if other machines reach it, and
    not from a container; ``off``: nor look there for other cameras."""
    insecure: bool = False
    """Serve other machines although any client that reaches the port controls the camera."""
    allowed_hosts: tuple[str, ...] = ()
    """Names, beside the address listened on, that clients may call this service by."""
    allowed_origins: tuple[str, ...] = ()
    """Origins of foreign pages that may control the camera, or hold its page in a frame, as in
    ``https://lab.example``."""
    tls_certificate: Path | None = None
    """A certificate and those it rests on, in PEM; https and wss instead of http and ws."""
    tls_key: Path | None = None
    """Its private key, in PEM, where it is not in the same file."""
    tokens_file: Path = Field(default_factory=lambda: _of_user(user_config_path) / "tokens.json")
    """File in which `transientcam token` keeps names and hashes of the tokens."""
    require_token: bool = False
    """Require a token even if only this machine reaches the service, as behind a proxy."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """The least important messages to log."""
    calibration: Path | None = None
    """A file written by `transientcam calibrate`; the one that was active last without it."""
    log_format: Literal["auto", "text", "json"] = "auto"
    """``auto`` is text on a terminal and JSON elsewhere."""
    workers: int = Field(default_factory=lambda: max(2, cores()), ge=2, le=256)
    """Threads that reconstruct and encode; at least 2, so that one long answer delays no other."""
    device: str = Field(default="cpu", pattern="^(cpu|auto|gpu(:.+)?)$", max_length=200)
    """What computes the pass over a frame: ``cpu``, ``gpu``, ``gpu:NAME`` with a part of an
    adapter's name, or ``auto``: a GPU for large frames, if there is one (gpu.md)."""
    sequence: SequenceSettings = SequenceSettings()
    reconstruction: ReconstructionSettings = ReconstructionSettings()
    sensor: SensorSettings = SensorSettings()
    lens: LensSettings = LensSettings()
    stream: StreamSettings = StreamSettings()
    history: HistorySettings = HistorySettings()
    limits: LimitSettings = LimitSettings()
    light: LightSettings = Field(default_factory=LightSettings)
    recordings: RecordingSettings = Field(default_factory=RecordingSettings)
    calibrations: CalibrationSettings = Field(default_factory=CalibrationSettings)

    @field_validator("host")
    @classmethod
    def _without_brackets(cls, host: str) -> str:
        return host.removeprefix("[").removesuffix("]")  # as addresses of IPv6 stand in URLs

    @property
    def needs_token(self) -> bool:
        """Whether clients need a token."""
        return self.require_token or not (self.on_loopback or self.insecure)

    @property
    def on_loopback(self) -> bool:
        """Whether only this machine can reach the service."""
        if self.host == "localhost":
            return True
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return False
