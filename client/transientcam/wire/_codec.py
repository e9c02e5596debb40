"""Bytes to maps and maps to bytes: the only place that uses msgpack."""

from collections.abc import Mapping
from typing import Any, Final, NoReturn

import msgpack  # type: ignore[import-untyped]  # it ships no types
from numpy.typing import NDArray

from transientcam.errors import ProtocolError
from transientcam.wire._arrays import buffer, wire_array

ALIGNMENT: Final = 8
"""An array's data starts at a multiple of this many bytes from the start of its message."""

_BIN_8 = 0xC4
_BIN_32 = 0xC6


def pack(document: Mapping[str, Any]) -> bytes:
    """Return a map as msgpack."""
    packer = msgpack.Packer(autoreset=False)
    packer.pack(document)
    packed: bytes = packer.bytes()
    return packed


def unpack(data: bytes | bytearray | memoryview | str, *, max_bytes: int) -> dict[str, Any]:
    """Return the map that untrusted bytes hold; every map within has string keys.

    Raises ProtocolError if the message is text, longer than ``max_bytes``, no msgpack, more than
    one value or not a map, or holds a key that is no string or an extension type.
    """
    if isinstance(data, str):
        raise ProtocolError("message", "text", "binary")
    if len(data) > max_bytes:
        raise ProtocolError("message", f"{len(data)} bytes", f"at most {max_bytes} bytes")
    try:
        # the limits of lengths inside follow from the length of the whole
        document = msgpack.unpackb(data, object_hook=_string_keys, ext_hook=_no_extension)
    except ProtocolError:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        # ValueError is the root of what msgpack raises, TypeError an unhashable key
        raise ProtocolError(
            "message", f"no msgpack ({error or 'too deeply nested'})", "a map"
        ) from (error)
    if not isinstance(document, dict):
        raise ProtocolError("message", document, "a map")
    return document


def pack_with_array(document: Mapping[str, Any], array: NDArray[Any]) -> bytes:
    """Return a map as msgpack with ``array`` as its last entry, under ``"array"``.

    An entry ``"pad"`` of zeros before it lets the array's data start at a multiple of `ALIGNMENT`,
    so that a reader may view it in place. The data is copied once.
    """
    array = wire_array(array)
    data = buffer(array)
    return b"".join((array_head(document, array.dtype.str, array.shape, len(data)), data))


def array_head(
    document: Mapping[str, Any], dtype: str, shape: tuple[int, ...], data_bytes: int
) -> bytes:
    """Return what comes before the data of an array in `pack_with_array`."""
    packer = msgpack.Packer(autoreset=False)
    packer.pack_map_header(len(document) + 2)
    for key, value in document.items():
        packer.pack(key)
        packer.pack(value)
    packer.pack("pad")
    front = packer.bytes()
    packer.reset()
    packer.pack("array")
    packer.pack_map_header(3)
    for part in ("dtype", dtype, "shape", list(shape), "data"):
        packer.pack(part)
    back = packer.bytes() + bytes((_BIN_32,)) + data_bytes.to_bytes(4, "big")
    padding = -(len(front) + 2 + len(back)) % ALIGNMENT
    return b"".join((front, bytes((_BIN_8, padding)), bytes(padding), back))


def _string_keys(document: dict[Any, Any]) -> dict[str, Any]:
    for key in document:
        if not isinstance(key, str):
            raise ProtocolError("key", key, "a string")
    return document


def _no_extension(code: int, data: bytes) -> NoReturn:
    raise ProtocolError("message", f"an extension type ({code})", "without extension types")
