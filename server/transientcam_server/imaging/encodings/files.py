"""Products as files that other programs open: TIFF, PLY and CSV. Runs on workers."""

import io
import json
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging.products import Product

_Array = NDArray[Any]
_TIFF_AXES: Final = {"y": "Y", "x": "X", "time": "T"}
_VERTEX: Final = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("range", "<f4"),
        ("amplitude", "<f4"),
        ("flags", "u1"),
    ]
)
_PLY_TYPES: Final = {"<f4": "float", "|u1": "uchar"}


def tiff(
    product: Product, array: _Array, meta: Mapping[str, Any], extra: Mapping[str, Any], *_: Any
) -> bytes:
    """Return a page for each image, in the product's own type; its description says what it is."""
    import tifffile  # as long as Pillow

    description = product.description
    file = io.BytesIO()
    tifffile.imwrite(
        file,
        np.asarray(array, dtype=description.dtype),
        photometric="minisblack",
        software="transientcam",
        metadata={
            "axes": "".join(_TIFF_AXES.get(axis, "Q") for axis in description.axes),
            "product": product.name,
            "unit": description.unit,
            "meta": dict(meta),
            **extra,
        },
    )
    return file.getvalue()


def ply(
    product: Product, array: _Array, meta: Mapping[str, Any], extra: Mapping[str, Any], *_: Any
) -> bytes:
    """Return the points that have a range as a binary PLY file.

    A vertex is x, y, z and range in m, the amplitude of the first return in DN, and the flags.
    """
    there = np.isfinite(array[2])
    vertices = np.empty(np.count_nonzero(there), dtype=_VERTEX)
    for name, plane in zip(("x", "y", "z"), array, strict=True):
        vertices[name] = plane[there]
    for name, beside in (("range", "range"), ("amplitude", "direct"), ("flags", "flags")):
        vertices[name] = extra[beside][there]
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {json.dumps({'unit': 'm', 'frame': meta['frame']})}",
        f"element vertex {len(vertices)}",
        *(f"property {_PLY_TYPES[_VERTEX[name].str]} {name}" for name in _VERTEX.names or ()),
        "end_header\n",
    ]
    return "\n".join(lines).encode("ascii") + vertices.tobytes()


def csv(product: Product, array: _Array, *_: Any) -> bytes:
    """Return a line for each row, with ``nan`` where there is no value."""
    file = io.StringIO()
    whole = array.dtype.kind == "u"
    np.savetxt(file, array, fmt="%d" if whole else "%.9g", delimiter=",")
    return file.getvalue().encode("ascii")
