"""Messages from untrusted bytes: every failure is a `ProtocolError` that names its place."""

from collections.abc import Mapping
from typing import Any, Final, cast

from transientcam.documents import FrameMeta
from transientcam.errors import ProtocolError
from transientcam.frame import Frame
from transientcam.wire import _fields as fields
from transientcam.wire._arrays import DTYPES, MAX_DIMENSIONS, MAX_LENGTH, parse_array
from transientcam.wire._codec import unpack
from transientcam.wire._contract import (
    F32,
    MAX_CLIENT_MESSAGE_BYTES,
    MAX_CREDITS,
    MAX_DECIMATION,
    MAX_SERVER_MESSAGE_BYTES,
    MAX_SUBSCRIPTIONS,
    VERSION,
)
from transientcam.wire._encodings import decoded, encoding_names
from transientcam.wire._messages import (
    Ack,
    Channel,
    ClientMessage,
    ErrorMessage,
    Hello,
    Notice,
    ServerMessage,
    Subscribe,
    Subscription,
)

MAX_INTEGER: Final = 2**53 - 1
"""Frame numbers and counts stay exact in the browser's numbers."""
_MAX_CHANNELS = 64
_FRAME_KEYS = frozenset(
    ("v", "type", "channel", "product", "unit", "axes", "meta", "encode_s", "pad", "array")
) | {"brightness"}


def parse_client_message(data: bytes | bytearray | memoryview | str) -> ClientMessage:
    """Return the message of a client, from untrusted bytes.

    Raises ProtocolError naming the first part that docs/stream.md does not allow.
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

    Raises ProtocolError naming the first part that docs/stream.md does not allow.
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

    Raises ProtocolError as `parse_server_message`, and if the message is no frame.
    """
    message = parse_server_message(data, max_bytes=max_bytes)
    if not isinstance(message, Frame):
        raise ProtocolError("type", type(message).__name__.lower(), "frame")
    return message


def parse_channels(document: Mapping[str, Any]) -> tuple[Channel, ...]:
    """Return the channels that a hello or a ``sequence-changed`` notice lists.

    Raises ProtocolError naming the first part that docs/stream.md does not allow.
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
    product = fields.text(item, "product", path=path, max_length=64)
    encoding = _encoding(item, path)
    decimation = _optional_integer(item, "decimation", minimum=1, maximum=MAX_DECIMATION, path=path)
    return Subscription(product, rate, encoding, _region(item, path), decimation or 1)


def _encoding(item: Mapping[str, Any], path: str) -> str:
    if not _given(item, "encoding"):
        return F32
    encoding = fields.text(item, "encoding", path=path)
    if encoding not in encoding_names():
        raise ProtocolError(f"{path}.encoding", encoding, f"one of {', '.join(encoding_names())}")
    return encoding


def _region(item: Mapping[str, Any], path: str) -> tuple[int, int, int, int] | None:
    if not _given(item, "region"):
        return None
    numbers = fields.integers(item, "region", maximum=MAX_LENGTH, max_length=4, path=path)
    if len(numbers) != 4:
        raise ProtocolError(f"{path}.region", list(numbers), "x, y, width and height")
    x, y, width, height = numbers
    return x, y, width, height


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
        region=_region(item, path),
        decimation=_optional_integer(
            item, "decimation", minimum=1, maximum=MAX_DECIMATION, path=path
        )
        or 1,
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
    if _given(document, "encoding"):
        array = decoded(fields.text(document, "encoding"), array, document)
    if array.ndim != len(axes):
        raise ProtocolError("array.shape", list(array.shape), f"as long as axes {list(axes)}")
    return Frame(
        product=fields.text(document, "product"),
        unit=fields.text(document, "unit"),
        axes=axes,
        meta=cast("FrameMeta", meta),  # of its keys only ``frame`` is checked
        array=array,
        encode_s=fields.number(document, "encode_s"),
        channel=_optional_integer(document, "channel", minimum=0, maximum=MAX_INTEGER),
        extra={key: value for key, value in document.items() if key not in _FRAME_KEYS},
    )


def _given(document: Mapping[str, Any], key: str) -> bool:
    return document.get(key) is not None


def _optional_integer(
    document: Mapping[str, Any], key: str, *, minimum: int, maximum: int, path: str = ""
) -> int | None:
    if not _given(document, key):
        return None
    return fields.integer(document, key, minimum=minimum, maximum=maximum, path=path)
