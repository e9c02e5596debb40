"""The messages of docs/stream.md as values, and as bytes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from transientcam.frame import Frame
from transientcam.wire._codec import pack, pack_with_array
from transientcam.wire._contract import F32, VERSION


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
        """Return it as a map, without options that have their default."""
        document: dict[str, Any] = {"product": self.product, "max_rate_hz": self.max_rate_hz}
        if self.encoding != F32:
            document["encoding"] = self.encoding
        return document | _cut(self.region, self.decimation)


@dataclass(frozen=True, slots=True)
class Subscribe:
    """A client's subscriptions, which replace those before.

    ``credits`` is how many frames the server may have on the way unacknowledged (None: no limit),
    ``start`` the first frame to send (None: the next).
    """

    subscriptions: tuple[Subscription, ...]
    token: str | None = field(default=None, repr=False)
    credits: int | None = None
    start: int | None = None

    def to_document(self) -> dict[str, Any]:
        """Return the message as a map."""
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
    """The client acknowledges this frame and all before it."""

    frame: int

    def to_document(self) -> dict[str, Any]:
        """Return the message as a map."""
        return {"type": "ack", "frame": self.frame}


@dataclass(frozen=True, slots=True)
class Channel:
    """Description of the frames of one subscription: ``dtype`` and ``shape`` are of its arrays.

    An array that is sent as codes is decoded before a `Frame` holds it.
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
        """Return the message as a map."""
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
        """Return the message as a map."""
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
    """An event for clients: its ``kind``, and its other keys in ``details``.

    `NOTICES` lists the kinds. A client ignores unknown ones.
    """

    kind: str
    details: Mapping[str, Any] = field(default_factory=dict)

    def to_document(self) -> dict[str, Any]:
        """Return the message as a map."""
        return {"type": "notice", "kind": self.kind, **self.details}


@dataclass(frozen=True, slots=True)
class ErrorMessage:
    """The answer to a bad message: a problem document, as over REST."""

    problem: Mapping[str, Any]

    def to_document(self) -> dict[str, Any]:
        """Return the message as a map."""
        return {"type": "error", "problem": dict(self.problem)}


def _cut(region: tuple[int, ...] | None, decimation: int) -> dict[str, Any]:
    """Return region and decimation as a map, without those that have their default."""
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

    Raises ParameterError if the array's dtype does not travel.
    """
    document = frame_document(
        product=product,
        unit=unit,
        axes=axes,
        meta=meta,
        encode_s=encode_s,
        channel=channel,
        extra=extra,
    )
    return pack_with_array(document, array)


def frame_document(
    *,
    product: str,
    unit: str,
    axes: tuple[str, ...],
    meta: Mapping[str, Any],
    encode_s: float = 0.0,
    channel: int | None = None,
    extra: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the map of `encode_frame` without its array."""
    document: dict[str, Any] = {"v": VERSION, "type": "frame"}
    if channel is not None:
        document["channel"] = channel
    return document | {
        "product": product,
        "unit": unit,
        "axes": list(axes),
        "meta": dict(meta),
        "encode_s": encode_s,
        **(extra or {}),
    }
