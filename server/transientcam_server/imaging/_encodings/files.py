"""Products as files that other programs open: TIFF, PLY and CSV. Runs on workers."""

import io
import json
from typing import Final

import numpy as np

from transientcam import Frame

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


def tiff(frame: Frame) -> bytes:
    """Return a page for each image, in the product's own type; the metadata describe it."""
    import tifffile  # as long as Pillow

    file = io.BytesIO()
    tifffile.imwrite(
        file,
        frame.array,
        photometric="minisblack",
        software="transientcam",
        metadata={
            "axes": "".join(_TIFF_AXES.get(axis, "Q") for axis in frame.axes),
            "product": frame.product,
            "unit": frame.unit,
            "meta": dict(frame.meta),
            **frame.extra,
        },
    )
    return file.getvalue()


def ply(frame: Frame) -> bytes:
    """Return the points that have a range as a binary PLY file.

    A vertex is x, y, z and range in m, the amplitude of the first return in DN, and the flags.
    """
    there = np.isfinite(frame.array[2])
    vertices = np.empty(np.count_nonzero(there), dtype=_VERTEX)
    for name, plane in zip(("x", "y", "z"), frame.array, strict=True):
        vertices[name] = plane[there]
    for name, beside in (("range", "range"), ("amplitude", "direct"), ("flags", "flags")):
        vertices[name] = frame.extra[beside][there]
    mounted = {"extrinsics": found} if (found := frame.meta.get("extrinsics")) else {}
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {json.dumps({'unit': 'm', 'frame': frame.frame} | mounted)}",
        f"element vertex {len(vertices)}",
        *(f"property {_PLY_TYPES[_VERTEX[name].str]} {name}" for name in _VERTEX.names or ()),
        "end_header\n",
    ]
    return "\n".join(lines).encode("ascii") + vertices.tobytes()


def csv(frame: Frame) -> bytes:
    """Return a line for each row, with ``nan`` where there is no value."""
    file = io.StringIO()
    whole = frame.array.dtype.kind == "u"
    np.savetxt(file, frame.array, fmt="%d" if whole else "%.9g", delimiter=",")
    return file.getvalue().encode("ascii")
