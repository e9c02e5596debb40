"""How results show themselves: a line of text, and a map for notebooks.

The client has pictures of its own (`transientcam.notebook`); this package stands without it.
"""

import base64
import struct
from html import escape
from typing import Any

import numpy as np

from transientcam_moments.arrays._planes import Array

_MOST_PIXELS = 640  # along either side of a map; of larger ones every so many pixels are shown
_STOPS = ((0, 0, 0), (87, 16, 110), (188, 55, 84), (249, 142, 9), (252, 255, 164))
_NO_VALUE = (70, 90, 110)


def summary(result: Any) -> str:
    """Return a line for a named tuple of arrays: shape of each, and the span of real ones."""
    parts = [f"{name} {described(part)}" for name, part in result._asdict().items()]
    return f"<{type(result).__name__}: {'; '.join(parts)}>"


def described(values: Any) -> str:
    """Return the shape of an array, with the span of NumPy's real ones; anything else as it is."""
    if not hasattr(values, "shape"):
        return repr(values)
    shape = " x ".join(map(str, values.shape)) or "1"
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "iuf":
        return f"{shape} {values.dtype}"
    return f"{shape}, {span(values)}"


def span(values: Array) -> str:
    """Return the least, middle and greatest finite number in words, and how many are not."""
    array = np.asarray(values)
    there = array[np.isfinite(array)]
    if not there.size:
        return "no value"
    low, middle, high = there.min(), np.median(there), there.max()
    without = 1 - there.size / array.size
    return f"{low:.4g} to {high:.4g}, median {middle:.4g}" + (
        f", {without:.1%} without" if without else ""
    )


def map_html(values: Array, *, title: str, unit: str) -> str:
    """Return a map (H, W) with its scale, from the 1st to the 99th percentile.

    Pixels without a value are grey.
    """
    array = np.asarray(values, dtype=float)
    there = array[np.isfinite(array)]
    if not there.size:
        return f"<p>{escape(title)}: no pixel has a value</p>"
    low, high = np.percentile(there, (1, 99)).tolist()
    step = -(-max(array.shape) // _MOST_PIXELS)
    with np.errstate(invalid="ignore"):
        level = 1 + 254 * np.clip((array[::step, ::step] - low) / max(high - low, 1e-300), 0, 1)
    source = base64.b64encode(_bmp(np.nan_to_num(level, nan=0.0).astype(np.uint8))).decode()
    colours = ", ".join(f"rgb{each}" for each in _STOPS)
    height, width = array.shape
    return (
        '<figure style="display:inline-block;margin:0">'
        f"<figcaption>{escape(title)}, {width} x {height} pixels</figcaption>"
        f'<img alt="{escape(title)}" src="data:image/bmp;base64,{source}" '
        'style="image-rendering:pixelated;min-width:320px">'
        f'<div style="height:10px;background:linear-gradient(to right, {colours})"></div>'
        '<div style="display:flex;justify-content:space-between">'
        f"<span>{low:.4g} {escape(unit)}</span><span>{high:.4g} {escape(unit)}</span></div>"
        "</figure>"
    )


def _bmp(level: Array) -> bytes:
    """Return levels (H, W), 0 for no value, as a picture of 256 colours (Windows bitmap)."""
    height, width = level.shape
    rows = np.zeros((height, -(-width // 4) * 4), np.uint8)  # a whole number of 32 bits a row
    rows[:, :width] = level[::-1]
    colours = np.zeros((256, 4), np.uint8)
    places = np.linspace(0, 254, len(_STOPS))
    channels = np.transpose(_STOPS)[::-1]  # blue first
    colours[1:, :3] = np.stack([np.interp(np.arange(255), places, each) for each in channels], -1)
    colours[0, :3] = _NO_VALUE[::-1]
    start = 14 + 40 + colours.nbytes
    head = struct.pack("<2sIHHI", b"BM", start + rows.nbytes, 0, 0, start)
    form = struct.pack("<IiiHHIIiiII", 40, width, height, 1, 8, 0, rows.nbytes, 2835, 2835, 256, 0)
    return head + form + colours.tobytes() + rows.tobytes()
