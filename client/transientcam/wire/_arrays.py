"""Arrays as plain maps: ``{"dtype": "<f4", "shape": [..], "data": bin}``, rows last."""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam.errors import ParameterError, ProtocolError
from transientcam.wire import _fields as fields

DTYPES: Final = {name: np.dtype(name) for name in ("<f4", "<f8", "<c8", "<u2", "|u1")}
"""The dtypes that messages may hold; none whose bytes could stand for a Python object."""
MAX_DIMENSIONS: Final = 6
MAX_LENGTH: Final = 2**31 - 1
MAX_BYTES: Final = 2**32 - 1
"""The longest binary that msgpack can hold."""


def wire_array(array: NDArray[Any]) -> NDArray[Any]:
    """Return ``array`` in the form that messages hold: C order, little-endian, a known dtype.

    The same object comes back where it already has that form.
    Raises ParameterError if its dtype is none of `DTYPES` in any byte order, it has more than 6
    dimensions or does not fit into one message.
    """
    name = array.dtype.newbyteorder("<").str
    if name not in DTYPES:
        raise ParameterError("dtype", array.dtype.str, f"one of {', '.join(DTYPES)}")
    if array.ndim > MAX_DIMENSIONS:
        raise ParameterError("dimensions", array.ndim, f"at most {MAX_DIMENSIONS}")
    if array.nbytes > MAX_BYTES:
        raise ParameterError("size", f"{array.nbytes} bytes", f"at most {MAX_BYTES} bytes")
    # order="C" keeps a 0-d array 0-d, which ascontiguousarray does not
    return np.asarray(array, dtype=DTYPES[name], order="C")


def buffer(array: NDArray[Any]) -> memoryview:
    """Return the bytes of an array in the form of `wire_array`, without copying them."""
    # an empty array has no bytes to show, and a view of shape (0, ..) cannot be cast
    return memoryview(b"") if array.size == 0 else array.reshape(-1).view(np.uint8).data


def array_document(array: NDArray[Any]) -> dict[str, Any]:
    """Return the map that stands for ``array``; its data is a view, not a copy.

    Raises ParameterError as `wire_array` does.
    """
    array = wire_array(array)
    return {"dtype": array.dtype.str, "shape": list(array.shape), "data": buffer(array)}


def parse_array(document: Mapping[str, Any], *, path: str = "array") -> NDArray[Any]:
    """Return the array an untrusted map stands for, as a read-only view of its data.

    Raises ProtocolError if the dtype is none of `DTYPES`, a length is negative or there are too
    many, or the data is not exactly as long as dtype and shape say.
    """
    name = fields.text(document, "dtype", path=path)
    if name not in DTYPES:
        raise ProtocolError(fields.join(path, "dtype"), name, f"one of {', '.join(DTYPES)}")
    dtype = DTYPES[name]
    shape = fields.integers(
        document, "shape", maximum=MAX_LENGTH, max_length=MAX_DIMENSIONS, path=path
    )
    data = document.get("data")
    if not isinstance(data, bytes):
        raise ProtocolError(fields.join(path, "data"), data, "binary")
    expected = math.prod(shape) * dtype.itemsize
    if len(data) != expected:
        raise ProtocolError(
            fields.join(path, "data"), f"{len(data)} bytes", f"the {expected} bytes of the shape"
        )
    return np.frombuffer(data, dtype=dtype).reshape(shape)
