"""Messages of the stream in the encodings of the wire contract."""

import time
from dataclasses import replace
from functools import partial
from typing import Any

from transientcam import Frame, wire
from transientcam_server.imaging._encodings.encoding import MSGPACK, Encoding, message
from transientcam_server.imaging._products.products import Product


def stream_encoding(name: str) -> Encoding:
    """Return what writes the messages of an encoding of the wire contract.

    Raises KeyError if there is none of that name.
    """
    if name == wire.F32:
        return MSGPACK
    return Encoding(name, wire.MEDIA_TYPE, partial(_coded, wire.ENCODINGS[name]))


def _coded(encoding: wire.Encoding, frame: Frame) -> bytes:
    begin_s = time.perf_counter()
    coded = encoding.encode(frame.array)
    error: dict[str, Any] = {}
    if encoding.error is not None:
        median, most = encoding.error(frame.array, coded)
        error = {"approximate": True, "max_error": most, "median_error": median}
    return message(
        replace(
            frame,
            array=coded.array,
            encode_s=frame.encode_s + time.perf_counter() - begin_s,
            extra={**frame.extra, **error, "encoding": encoding.name, **coded.fields},
        )
    )


def encoding_name(encoding: Encoding) -> str:
    """Return the name of an encoding in the wire contract."""
    return wire.F32 if encoding is MSGPACK else encoding.name


def travelling(
    product: Product, encoding: Encoding, shape: tuple[int, ...]
) -> tuple[str, tuple[int, ...]]:
    """Return dtype and shape of the array in a message, for a product of this shape."""
    if encoding is MSGPACK:
        return product.description.dtype, shape
    codes = wire.ENCODINGS[encoding.name]
    return codes.dtype, codes.shape(shape)
