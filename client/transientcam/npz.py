"""A frame as .npz: what the daemon answers, and what `transientcam capture` saves."""

import io
import json
from typing import Any

import numpy as np

from transientcam.frame import Frame


def npz_bytes(frame: Frame) -> bytes:
    """Return a frame with everything that belongs to it, as `numpy.load` reads it.

    ``array`` is there with ``product``, ``unit`` and ``axes``, ``meta`` (JSON), and what only some
    products have: numbers and lists of numbers as arrays (``time_s``), all else as JSON
    (``labels``).
    """
    parts: dict[str, Any] = {
        "array": frame.array,
        "product": frame.product,
        "unit": frame.unit,
        "axes": np.array(frame.axes),
        "meta": json.dumps(dict(frame.meta)),
        **{name: _part(value) for name, value in frame.extra.items()},
    }
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **parts)
    return file.getvalue()


def _part(value: Any) -> Any:
    numbers = value if isinstance(value, list) else [value]
    if all(isinstance(each, int | float) for each in numbers):
        return np.asarray(value)
    return json.dumps(value)
