"""The messages of docs/stream.md as values, and as bytes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypedDict

from numpy.typing import NDArray

from transientcam.frame import Frame
from transientcam.wire.codec import pack, pack_with_array
from transientcam.wire.contract import F32, VERSION


class PixelCounts(TypedDict):
    """How many pixels of a frame carry each flag; one pixel may carry several."""

    total: int
    valid: int
    biased: int
    no_signal: int
    saturated: int
    non_finite: int
    degenerate: int
    replaced: int


class PredictedStd(TypedDict):
    """Standard deviation that the sensor's noise gives a frame's range, in m."""

    median: float
    p90: float
    """90 % of the pixels are better."""
    first_order_share: float
    """Share of the pixels where the noise model holds; that of the others is a rough figure."""


class FrameMeta(TypedDict):
    """What is known of a frame, whatever product of it is sent."""

    frame: int
    """Counted by the server from 1; never resets while it runs."""
    sequence_id: int
    calibration_id: str
    reconstruction_id: int
    """Counts the settings of the reconstruction that the server has had."""
    device_time_s: float
    """Start of the first exposure, by the camera's clock."""
    host_time_s: float
    """Arrival of the last image, Unix time."""
    capture_s: float
    reconstruct_s: float | None
    """None until something of this frame was computed."""
    base_frequency_hz: float
    harmonics: int
    zeroth: str
    exposure_s: float
    takes: int
    width: int
    height: int
    temperature_c: float
    lost_images: int
    """Images lost or corrupt between the frame before and this one."""
    rejected_images: int | None
    """Images left out of the average over takes as outliers; None until it was computed."""
    pixels: PixelCounts | None
    predicted_range_std_m: PredictedStd | None
    """None until the range of this frame was computed."""
    region: list[int]
    """Which pixels of the frame this is about: column and row of the first, width, height."""
    decimation: int
    """Only every so many of them are here, both ways."""


@dataclass(frozen=True, slots=True)
class Subscription:
    """One product to be streamed.

    Attributes
    ----------
    max_rate_hz
        No more frames a second than this; None for all.
    encoding
        One of `ENCODINGS`; frames arrive decoded.
    region
        Column and row of the first pixel, width and height; None for the whole frame.
    decimation
        Only every so many pixels of the region, both ways.
    """

    product: str
    max_rate_hz: float | None = None
    encoding: str = F32
    region: tuple[int, int, int, int] | None = None
    decimation: int = 1

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels; what says no more than the default is left out."""
        document: dict[str, Any] = {"product": self.product, "max_rate_hz": self.max_rate_hz}
        if self.encoding != F32:
            document["encoding"] = self.encoding
        return document | _cut(self.region, self.decimation)


@dataclass(frozen=True, slots=True)
class Subscribe:
    """What a client wants from now on, instead of what it had.

    ``credits`` is how many frames the server may have on the way unacknowledged (None: as many as
    it likes), ``start`` the first frame wanted (None: the next).
    """

    subscriptions: tuple[Subscription, ...]
    token: str | None = field(default=None, repr=False)
    credits: int | None = None
    start: int | None = None

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {
            "type": "subscribe",
            "v": VERSION,
            "token": self.token,
            "subscriptions": [each.to_document() for each in self.subscriptions],
            "credits": self.credits,
            "start": self.start,
        }


@dataclass(frozen=True, slots=True)
class Ack:
    """The client is done with this frame and all before it."""

    frame: int

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {"type": "ack", "frame": self.frame}


@dataclass(frozen=True, slots=True)
class Channel:
    """What the messages of one subscription look like: ``dtype`` and ``shape`` are of its arrays.

    An array that travels as codes is decoded before a `Frame` holds it.
    """

    channel: int
    product: str
    unit: str
    axes: tuple[str, ...]
    dtype: str
    shape: tuple[int, ...]
    encoding: str = F32
    region: tuple[int, ...] | None = None
    decimation: int = 1

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {
            "channel": self.channel,
            "product": self.product,
            "unit": self.unit,
            "axes": list(self.axes),
            "dtype": self.dtype,
            "shape": list(self.shape),
            "encoding": self.encoding,
            **_cut(self.region, self.decimation),
        }


@dataclass(frozen=True, slots=True)
class Hello:
    """The server's answer to a subscription."""

    session: str
    server: Mapping[str, Any]
    channels: tuple[Channel, ...]
    sequence: Mapping[str, Any]
    camera: Mapping[str, Any]

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {
            "type": "hello",
            "v": VERSION,
            "session": self.session,
            "server": dict(self.server),
            "channels": [channel.to_document() for channel in self.channels],
            "sequence": dict(self.sequence),
            "camera": dict(self.camera),
        }


@dataclass(frozen=True, slots=True)
class Notice:
    """Something a client should know: ``kind``, and what more there is to it in ``details``.

    `NOTICES` lists the kinds there are. A client passes over kinds it does not know.
    """

    kind: str
    details: Mapping[str, Any] = field(default_factory=dict)

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {"type": "notice", "kind": self.kind, **self.details}


@dataclass(frozen=True, slots=True)
class ErrorMessage:
    """The answer to a bad message: a problem as REST would answer it."""

    problem: Mapping[str, Any]

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {"type": "error", "problem": dict(self.problem)}


def _cut(region: tuple[int, ...] | None, decimation: int) -> dict[str, Any]:
    """Return which pixels are meant, as far as it is not all of them."""
    cut: dict[str, Any] = {} if region is None else {"region": list(region)}
    return cut if decimation == 1 else cut | {"decimation": decimation}


ClientMessage = Subscribe | Ack
ServerMessage = Hello | Frame | Notice | ErrorMessage


def encode(message: Subscribe | Ack | Hello | Notice | ErrorMessage) -> bytes:
    """Return any message but a frame as bytes."""
    return pack(message.to_document())


def encode_frame(
    *,
    product: str,
    unit: str,
    axes: tuple[str, ...],
    meta: Mapping[str, Any],
    array: NDArray[Any],
    encode_s: float = 0.0,
    channel: int | None = None,
    extra: Mapping[str, Any] | None = None,
) -> bytes:
    """Return one product of a frame as bytes, for the stream (with ``channel``) and for REST.

    Raises
    ------
    ParameterError
        If the array's dtype does not travel.
    """
    document: dict[str, Any] = {"v": VERSION, "type": "frame"}
    if channel is not None:
        document["channel"] = channel
    document |= {
        "product": product,
        "unit": unit,
        "axes": list(axes),
        "meta": dict(meta),
        "encode_s": encode_s,
        **(extra or {}),
    }
    return pack_with_array(document, array)
