"""A frame as the bytes of a file."""

import json
from collections.abc import Callable
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam.frame import Frame, npy_bytes, npz_bytes
from transientcam.wire import encode_frame


class Format(StrEnum):
    """Formats that a frame is saved in, by their suffix."""

    NPY = "npy"
    """The array alone."""
    NPZ = "npz"
    """``array`` with ``product``, ``unit``, ``axes``, ``meta`` (JSON), ``time_s``, ``labels``."""
    PNG = "png"
    """As the daemon encodes it: 16 bit, or false colours."""
    TIFF = "tiff"
    """Unchanged values, a page for each image; also ``.tif``."""
    PLY = "ply"
    """Of pointcloud: points with range, amplitude and flags."""
    CSV = "csv"
    """A line for each row, of products that are images."""
    MSGPACK = "msgpack"
    """The message of docs/stream.md."""
    JSON = "json"
    """Everything as text; null for NaN, [re, im] for a complex number."""


MADE_BY_DAEMON: Final = frozenset((Format.PNG, Format.TIFF, Format.PLY, Format.CSV))
"""Formats that are downloaded as the daemon writes them."""


def frame_bytes(frame: Frame, form: Format) -> bytes:
    """Return ``frame`` in any format but those of `MADE_BY_DAEMON`."""
    return _WRITERS[form](frame)


def _msgpack(frame: Frame) -> bytes:
    return encode_frame(
        product=frame.product,
        unit=frame.unit,
        axes=frame.axes,
        meta=frame.meta,
        array=frame.array,
        encode_s=frame.encode_s,
        extra=frame.extra,
    )


def _json(frame: Frame) -> bytes:
    document = {
        "product": frame.product,
        "unit": frame.unit,
        "axes": frame.axes,
        "meta": dict(frame.meta),
        **frame.extra,
        "array": _nested(frame.array),
    }
    return json.dumps(document, allow_nan=False).encode()


def _nested(array: NDArray[Any]) -> Any:
    if array.dtype.kind == "c":
        array = np.stack((np.real(array), np.imag(array)), axis=-1)
    values = array.astype(object)
    values[~np.isfinite(array)] = None
    return values.tolist()


_WRITERS: dict[Format, Callable[[Frame], bytes]] = {
    Format.NPY: npy_bytes,
    Format.NPZ: npz_bytes,
    Format.MSGPACK: _msgpack,
    Format.JSON: _json,
}
