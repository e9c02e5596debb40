"""The messages of docs/stream.md as values, and their parsers for untrusted bytes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, TypedDict

from numpy.typing import NDArray

from transientcam.errors import ProtocolError
from transientcam.frame import Frame
from transientcam.wire import fields
from transientcam.wire.arrays import DTYPES, MAX_DIMENSIONS, MAX_LENGTH, parse_array
from transientcam.wire.codec import pack, pack_with_array, unpack
from transientcam.wire.contract import (
    MAX_CLIENT_MESSAGE_BYTES,
    MAX_CREDITS,
    MAX_SERVER_MESSAGE_BYTES,
    MAX_SUBSCRIPTIONS,
    VERSION,
)

MAX_INTEGER: Final = 2**53 - 1
"""Frame numbers and counts stay exact in the browser's numbers."""
_MAX_CHANNELS = 64


class PixelCounts(TypedDict):
    """How many pixels of a frame carry each flag; one pixel may carry several."""

    total: int
    valid: int
    biased: int
    no_signal: int
    saturated: int
    non_finite: int
    degenerate: int


class FrameMeta(TypedDict):
    """What is known of a frame, whatever product of it is sent."""

    frame: int
    """Counted by the server from 1; never resets while it runs."""
    sequence_id: int
    calibration_id: str
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
    pixels: PixelCounts | None


@dataclass(frozen=True, slots=True)
class Subscription:
    """One product to be streamed; ``max_rate_hz`` None is every frame."""

    product: str
    max_rate_hz: float | None = None

    def to_document(self) -> dict[str, Any]:
        """Return the map that travels."""
        return {"product": self.product, "max_rate_hz": self.max_rate_hz}


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
    """What the frames of one subscription look like."""

    channel: int
    product: str
    unit: str
    axes: tuple[str, ...]
    dtype: str
    shape: tuple[int, ...]
    encoding: str = "f32"

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

    Known kinds: ``dropped``, ``lost-images``, ``camera-lost``, ``camera-back``,
    ``sequence-changed``. A client passes over kinds it does not know.
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


ClientMessage = Subscribe | Ack
ServerMessage = Hello | Frame | Notice | ErrorMessage
_FRAME_KEYS = frozenset(
    ("v", "type", "channel", "product", "unit", "axes", "meta", "encode_s", "pad", "array")
)


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


def parse_client_message(data: bytes | bytearray | memoryview | str) -> ClientMessage:
    """Return the message of a client, from untrusted bytes.

    Raises
    ------
    ProtocolError
        Naming the first part that is not as docs/stream.md says.
    """
    document = unpack(data, max_bytes=MAX_CLIENT_MESSAGE_BYTES)
    kind = fields.text(document, "type")
    if kind == "subscribe":
        return _subscribe(document)
    if kind == "ack":
        return Ack(fields.integer(document, "frame", minimum=0, maximum=MAX_INTEGER))
    raise ProtocolError("type", kind, "subscribe or ack")


def parse_server_message(
    data: bytes | bytearray | memoryview | str, *, max_bytes: int = MAX_SERVER_MESSAGE_BYTES
) -> ServerMessage:
    """Return the message of a server, from untrusted bytes.

    Raises
    ------
    ProtocolError
        Naming the first part that is not as docs/stream.md says.
    """
    document = unpack(data, max_bytes=max_bytes)
    match fields.text(document, "type"):
        case "frame":
            return _frame(document)
        case "hello":
            return _hello(document)
        case "notice":
            details = {key: each for key, each in document.items() if key not in ("type", "kind")}
            return Notice(fields.text(document, "kind"), details)
        case "error":
            return ErrorMessage(fields.mapping(document, "problem"))
        case kind:
            raise ProtocolError("type", kind, "hello, frame, notice or error")


def parse_frame(
    data: bytes | bytearray | memoryview, *, max_bytes: int = MAX_SERVER_MESSAGE_BYTES
) -> Frame:
    """Return the frame that the body of a REST answer holds.

    Raises
    ------
    ProtocolError
        As `parse_server_message`, and if the message is no frame.
    """
    message = parse_server_message(data, max_bytes=max_bytes)
    if not isinstance(message, Frame):
        raise ProtocolError("type", type(message).__name__.lower(), "frame")
    return message


def parse_channels(document: Mapping[str, Any]) -> tuple[Channel, ...]:
    """Return the channels that a hello or a ``sequence-changed`` notice lists.

    Raises
    ------
    ProtocolError
        Naming the first part that is not as docs/stream.md says.
    """
    items = fields.sequence(document, "channels", max_length=_MAX_CHANNELS)
    return tuple(_channel(item, f"channels[{index}]") for index, item in enumerate(items))


def _version(document: Mapping[str, Any]) -> None:
    if document.get("v") != VERSION:
        raise ProtocolError("v", document.get("v"), str(VERSION))


def _subscribe(document: Mapping[str, Any]) -> Subscribe:
    _version(document)
    items = fields.sequence(document, "subscriptions", max_length=MAX_SUBSCRIPTIONS)
    if not items:
        raise ProtocolError("subscriptions", items, "at least one subscription")
    token = fields.text(document, "token", max_length=4096) if _given(document, "token") else None
    return Subscribe(
        subscriptions=tuple(
            _subscription(item, f"subscriptions[{index}]") for index, item in enumerate(items)
        ),
        token=token,
        credits=_optional_integer(document, "credits", minimum=1, maximum=MAX_CREDITS),
        start=_optional_integer(document, "start", minimum=1, maximum=MAX_INTEGER),
    )


def _subscription(item: object, path: str) -> Subscription:
    if not isinstance(item, dict):
        raise ProtocolError(path, item, "a map")
    rate = None
    if _given(item, "max_rate_hz"):
        rate = fields.number(item, "max_rate_hz", path=path)
        if rate <= 0.0:
            raise ProtocolError(f"{path}.max_rate_hz", rate, "greater than 0")
    return Subscription(fields.text(item, "product", path=path, max_length=64), rate)


def _channel(item: object, path: str) -> Channel:
    if not isinstance(item, dict):
        raise ProtocolError(path, item, "a map")
    dtype = fields.text(item, "dtype", path=path)
    if dtype not in DTYPES:
        raise ProtocolError(f"{path}.dtype", dtype, f"one of {', '.join(DTYPES)}")
    return Channel(
        channel=fields.integer(item, "channel", minimum=0, maximum=MAX_INTEGER, path=path),
        product=fields.text(item, "product", path=path),
        unit=fields.text(item, "unit", path=path),
        axes=fields.strings(item, "axes", max_length=MAX_DIMENSIONS, path=path),
        dtype=dtype,
        shape=fields.integers(
            item, "shape", maximum=MAX_LENGTH, max_length=MAX_DIMENSIONS, path=path
        ),
        encoding=fields.text(item, "encoding", path=path),
    )


def _hello(document: Mapping[str, Any]) -> Hello:
    _version(document)
    return Hello(
        session=fields.text(document, "session"),
        server=fields.mapping(document, "server"),
        channels=parse_channels(document),
        sequence=fields.mapping(document, "sequence"),
        camera=fields.mapping(document, "camera"),
    )


def _frame(document: Mapping[str, Any]) -> Frame:
    _version(document)
    meta = fields.mapping(document, "meta")
    fields.integer(meta, "frame", minimum=0, maximum=MAX_INTEGER, path="meta")
    axes = fields.strings(document, "axes", max_length=MAX_DIMENSIONS)
    array = parse_array(fields.mapping(document, "array"))
    if array.ndim != len(axes):
        raise ProtocolError("array.shape", list(array.shape), f"as long as axes {list(axes)}")
    return Frame(
        product=fields.text(document, "product"),
        unit=fields.text(document, "unit"),
        axes=axes,
        meta=meta,
        array=array,
        encode_s=fields.number(document, "encode_s"),
        channel=_optional_integer(document, "channel", minimum=0, maximum=MAX_INTEGER),
        extra={key: value for key, value in document.items() if key not in _FRAME_KEYS},
    )


def _given(document: Mapping[str, Any], key: str) -> bool:
    return document.get(key) is not None


def _optional_integer(
    document: Mapping[str, Any], key: str, *, minimum: int, maximum: int
) -> int | None:
    if not _given(document, key):
        return None
    return fields.integer(document, key, minimum=minimum, maximum=maximum)
