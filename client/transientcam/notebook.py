"""Maps and tables as HTML, which notebooks show; nothing beside NumPy is needed."""

import base64
import struct
import zlib
from collections.abc import Mapping
from html import escape
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_MOST_PIXELS: Final = 640
"""Along either side of a picture; maps that are larger show every so many of their pixels."""
_STOPS: Final = ((30, 30, 40, 235, 255), (20, 90, 170, 160, 250), (90, 200, 130, 50, 220))
_NO_VALUE: Final = (48, 48, 48)


def palette() -> bytes:
    """Return 256 colours of three bytes.

    Index 0 (no value) is dark grey; then dark blue over green and orange to near white.
    """
    places = np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * 254.0
    colours = np.stack([np.interp(np.arange(255.0), places, each) for each in _STOPS], axis=-1)
    ramp: bytes = np.rint(colours).astype(np.uint8).tobytes()
    return bytes(_NO_VALUE) + ramp


def map_html(values: NDArray[Any], *, title: str, unit: str) -> str:
    """Return a map (H, W) in colours, with its scale from the 1st to the 99th percentile.

    Pixels without a value are grey.
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return f"<p>{escape(title)}: no pixel has a value</p>"
    low, high = (float(each) for each in np.percentile(finite, (1, 99)))
    step = -(-max(values.shape) // _MOST_PIXELS)
    shown = np.asarray(values[::step, ::step], dtype=np.float64)
    with np.errstate(invalid="ignore"):
        index = 1.0 + 254.0 * np.clip((shown - low) / max(high - low, 1e-300), 0.0, 1.0)
    picture = _png(np.nan_to_num(index, nan=0.0).astype(np.uint8))
    source = base64.b64encode(picture).decode()
    colours = ", ".join(f"rgb{each}" for each in zip(*_STOPS, strict=True))
    height, width = values.shape
    return (
        '<figure style="display:inline-block;margin:0">'
        f"<figcaption>{escape(title)}, {width} x {height} pixels</figcaption>"
        f'<img alt="{escape(title)}" src="data:image/png;base64,{source}" '
        'style="image-rendering:pixelated;min-width:320px">'
        f'<div style="height:10px;background:linear-gradient(to right, {colours})"></div>'
        '<div style="display:flex;justify-content:space-between">'
        f"<span>{low:.4g} {escape(unit)}</span><span>{high:.4g} {escape(unit)}</span></div>"
        "</figure>"
    )


def table_html(title: str, rows: Mapping[str, Any]) -> str:
    """Return names and values as a table."""
    cells = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(_shown(value))}</td></tr>"
        for name, value in rows.items()
    )
    return f"<p>{escape(title)}</p><table>{cells}</table>"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_shown(each)}" for name, each in value.items())
    return str(value)


def _png(index: NDArray[np.uint8]) -> bytes:
    """Return indices (H, W) into the palette as a PNG (ISO/IEC 15948)."""
    height, width = index.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), index], axis=1)  # filter 0 each row
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", palette()),
        (b"IDAT", zlib.compress(rows.tobytes(), 1)),
        (b"IEND", b""),
    ]
    chunks = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)
