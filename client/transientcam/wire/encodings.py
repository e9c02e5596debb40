"""Arrays in fewer bytes: what the encodings ``u16`` and ``reflection16`` of docs/stream.md do.

Both directions are here: arrays of `float32` to codes of 16 bits with the fields that a decoder
needs, and back.
"""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam.density import step_down, step_up
from transientcam.errors import ProtocolError
from transientcam.wire import fields
from transientcam.wire.arrays import array_document, parse_array
from transientcam.wire.contract import ENCODINGS, REFLECTION16, U16

_LAST_CODE: Final = 65535
_ZERO: Final = 32768
_UNIT: Final = 32767.0
_MOST: Final = 1.0 - 2.0 / _UNIT
"""Keeps |g| below 1 for any rounding of its two parts."""


class Coded(NamedTuple):
    """Codes of an array, and the fields that a decoder needs."""

    array: NDArray[np.uint16]
    fields: dict[str, Any]


def encode_u16(array: NDArray[Any]) -> Coded:
    """Return an image in even steps between its smallest and its largest value.

    A value is ``offset + scale * code``; code 0 stands for no value (NaN, infinities). No value is
    off by more than half of ``scale``.
    """
    values = np.asarray(array, dtype=np.float64)
    finite = np.isfinite(values)
    codes = np.zeros(values.shape, dtype="<u2")
    if not finite.any():
        return Coded(codes, {"scale": 0.0, "offset": 0.0})
    low = float(values.min(where=finite, initial=np.inf))
    high = float(values.max(where=finite, initial=-np.inf))
    scale = (high - low) / (_LAST_CODE - 1)
    steps = np.zeros_like(values) if scale == 0.0 else (values - low) / scale
    np.add(np.rint(steps, where=finite, out=steps), 1.0, where=finite, out=steps)
    np.copyto(codes, steps, where=finite, casting="unsafe")
    return Coded(codes, {"scale": scale, "offset": low - scale})


def decode_u16(codes: NDArray[Any], *, scale: float, offset: float) -> NDArray[np.float32]:
    """Return the values that `encode_u16` was given, to half of ``scale``; NaN for code 0."""
    with np.errstate(over="ignore"):  # of numbers that no encoder of ours sends
        values = (offset + scale * codes.astype(np.float64)).astype(np.float32)
    values[codes == 0] = np.nan
    return values


def encode_reflection16(coefficients: NDArray[np.floating[Any]]) -> Coded:
    """Return ``coefficients``, (2m + 1, ...), as brightness and 2m planes of codes.

    A reflection coefficient g becomes u = (2 / pi) arcsin|g| g / |g|, which is finer than g where
    |g| is near 1, and its two parts ``32768 + 32767 Re u`` and ``Im u``. |g| stays below 1
    for any rounding, and so the density positive.
    """
    brightness, reflection = step_down(coefficients)
    missing = ~np.isfinite(brightness)
    brightness = np.where(missing, np.nan, brightness)
    reflection[:, missing] = 0.0
    size = np.abs(reflection)
    u = (2.0 / np.pi) * np.arcsin(np.minimum(size, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):  # g = 0 is u = 0
        reflection *= np.where(size > 0.0, np.minimum(u, _MOST) / size, 0.0)
    codes = np.empty((2 * len(reflection), *brightness.shape), dtype="<u2")
    for part, values in ((0, reflection.real), (1, reflection.imag)):
        np.copyto(codes[part::2], np.rint(_ZERO + _UNIT * values), casting="unsafe")
    return Coded(codes, {"brightness": array_document(brightness.astype("<f4"))})


def decode_reflection16(codes: NDArray[Any], brightness: NDArray[Any]) -> NDArray[np.float32]:
    """Return ``coefficients``, (2m + 1, ...), of codes that `encode_reflection16` made."""
    parts = (codes.astype(np.float64) - _ZERO) / _UNIT
    reflection = parts[0::2] + 1j * parts[1::2]
    # g = sin(pi |u| / 2) u / |u|; numpy's sinc(x) is sin(pi x) / (pi x)
    reflection *= (np.pi / 2.0) * np.sinc(0.5 * np.abs(reflection))
    with np.errstate(over="ignore", invalid="ignore"):
        return step_up(brightness, reflection).astype(np.float32)


def decoded(encoding: str, array: NDArray[Any], document: Mapping[str, Any]) -> NDArray[Any]:
    """Return the array that the codes of a message stand for.

    Raises
    ------
    ProtocolError
        If the encoding is unknown, or one of its fields is missing or does not fit the array.
    """
    if encoding == U16:
        _require_codes(array, dimensions=2)
        scale, offset = fields.number(document, "scale"), fields.number(document, "offset")
        return decode_u16(array, scale=scale, offset=offset)
    if encoding == REFLECTION16:
        _require_codes(array, dimensions=3)
        if array.shape[0] % 2 or not array.shape[0]:
            raise ProtocolError("array.shape", list(array.shape), "an even number of planes")
        brightness = parse_array(fields.mapping(document, "brightness"), path="brightness")
        if brightness.shape != array.shape[1:] or brightness.dtype.str != "<f4":
            limit = f"<f4 of shape {list(array.shape[1:])}"
            raise ProtocolError("brightness.shape", list(brightness.shape), limit)
        return decode_reflection16(array, brightness)
    raise ProtocolError("encoding", encoding, f"one of {', '.join(ENCODINGS)}")


def _require_codes(array: NDArray[Any], *, dimensions: int) -> None:
    if array.dtype.str != "<u2":
        raise ProtocolError("array.dtype", array.dtype.str, "<u2")
    if array.ndim != dimensions:
        raise ProtocolError("array.shape", list(array.shape), f"{dimensions} lengths")
