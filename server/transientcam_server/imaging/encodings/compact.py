"""The encodings that a subscription may ask for, and what arrays look like in each."""

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam import Frame, density, wire
from transientcam_server.imaging.encodings.encoding import MSGPACK, Encoding, message
from transientcam_server.imaging.products import Product

_Array = NDArray[Any]
JUDGED_PIXELS: Final = 1024
JUDGED_PHASES: Final = 128


def _u16(frame: Frame) -> bytes:
    begin_s = time.perf_counter()
    return _message(frame, wire.encode_u16(frame.array), wire.U16, begin_s, {})


def _reflection16(frame: Frame) -> bytes:
    begin_s = time.perf_counter()
    coded = wire.encode_reflection16(frame.array)
    median, most = measured_error(frame.array, coded)
    error = {"approximate": True, "max_error": most, "median_error": median}
    return _message(frame, coded, wire.REFLECTION16, begin_s, error)


def measured_error(coefficients: _Array, coded: wire.Coded) -> tuple[float, float]:
    """Return median and maximum, over pixels, of the error that codes give a density.

    A pixel's error is the largest difference of both densities at `JUDGED_PHASES` even phases,
    over the largest value there. At most `JUDGED_PIXELS` pixels, evenly spread, are judged.
    """
    exact = coefficients.reshape(len(coefficients), -1)
    step = -(-exact.shape[1] // JUDGED_PIXELS)
    exact = exact[:, ::step].astype(np.float64)
    codes = coded.array.reshape(len(coded.array), -1)[:, ::step]
    brightness = np.frombuffer(coded.fields["brightness"]["data"], "<f4")[::step]
    phase_rad = np.linspace(0.0, 2.0 * np.pi, JUDGED_PHASES, endpoint=False)
    before = density(exact, phase_rad)
    after = density(wire.decode_reflection16(codes, brightness), phase_rad)
    peak = before.max(axis=0)
    lit = peak > 0.0  # False for NaN
    if not lit.any():
        return 0.0, 0.0
    error = np.abs(after - before)[:, lit].max(axis=0) / peak[lit]
    return float(np.median(error)), float(error.max())


def _message(
    frame: Frame, coded: wire.Coded, encoding: str, begin_s: float, error: Mapping[str, Any]
) -> bytes:
    return message(
        replace(
            frame,
            array=coded.array,
            encode_s=frame.encode_s + time.perf_counter() - begin_s,
            extra={**frame.extra, **error, "encoding": encoding, **coded.fields},
        )
    )


STREAM_ENCODINGS: Final = {
    wire.F32: MSGPACK,
    wire.U16: Encoding(wire.U16, wire.MEDIA_TYPE, _u16),
    wire.REFLECTION16: Encoding(wire.REFLECTION16, wire.MEDIA_TYPE, _reflection16),
}
"""What writes the messages of each encoding of the wire contract."""

_NAMES = {encoding.name: name for name, encoding in STREAM_ENCODINGS.items()}


def encoding_name(encoding: Encoding) -> str:
    """Return what the wire contract calls an encoding."""
    return _NAMES[encoding.name]


def travelling(
    product: Product, encoding: Encoding, shape: tuple[int, ...]
) -> tuple[str, tuple[int, ...]]:
    """Return dtype and shape of the array in a message, for a product of this shape."""
    match encoding_name(encoding):
        case wire.U16:
            return "<u2", shape
        case wire.REFLECTION16:  # E travels beside them, as brightness
            return "<u2", (shape[0] - 1, *shape[1:])
        case _:
            return product.description.dtype, shape
