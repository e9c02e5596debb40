"""Encodings of arrays in fewer bytes, ``u16`` and ``reflection16`` of docs/stream.md.

Both directions are here: arrays of `float32` to codes of 16 bits with the fields that a decoder
needs, and back.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam.density import density, step_down, step_up
from transientcam.errors import ProtocolError
from transientcam.wire import _fields as fields
from transientcam.wire._arrays import array_document, parse_array
from transientcam.wire._contract import F32, REFLECTION16, U16

_LAST_CODE: Final = 65535
_ZERO: Final = 32768
_UNIT: Final = 32767.0
_MOST: Final = 1.0 - 2.0 / _UNIT
"""Keeps |g| below 1 for any rounding of its two parts."""
SAMPLED_PIXELS: Final = 1024
SAMPLED_PHASES: Final = 128


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

    Raises ProtocolError if the encoding is unknown, or one of its fields is missing or does not fit
    the array.
    """
    if encoding not in ENCODINGS:
        raise ProtocolError("encoding", encoding, f"one of {', '.join((F32, *ENCODINGS))}")
    return ENCODINGS[encoding].decode(array, document)


def _decoded_u16(codes: NDArray[Any], document: Mapping[str, Any]) -> NDArray[np.float32]:
    _require_codes(codes, dimensions=2)
    scale, offset = fields.number(document, "scale"), fields.number(document, "offset")
    return decode_u16(codes, scale=scale, offset=offset)


def _decoded_reflection16(codes: NDArray[Any], document: Mapping[str, Any]) -> NDArray[np.float32]:
    _require_codes(codes, dimensions=3)
    if codes.shape[0] % 2 or not codes.shape[0]:
        raise ProtocolError("array.shape", list(codes.shape), "an even number of planes")
    brightness = parse_array(fields.mapping(document, "brightness"), path="brightness")
    if brightness.shape != codes.shape[1:] or brightness.dtype.str != "<f4":
        limit = f"<f4 of shape {list(codes.shape[1:])}"
        raise ProtocolError("brightness.shape", list(brightness.shape), limit)
    return decode_reflection16(codes, brightness)


def _require_codes(array: NDArray[Any], *, dimensions: int) -> None:
    if array.dtype.str != "<u2":
        raise ProtocolError("array.dtype", array.dtype.str, "<u2")
    if array.ndim != dimensions:
        raise ProtocolError("array.shape", list(array.shape), f"{dimensions} lengths")


def measured_error(coefficients: NDArray[Any], coded: Coded) -> tuple[float, float]:
    """Return median and maximum, over pixels, of the error that codes give a density.

    A pixel's error is the largest difference of both densities at `SAMPLED_PHASES` even phases,
    over the largest value there. At most `SAMPLED_PIXELS` pixels, evenly spread, are compared.
    """
    exact = coefficients.reshape(len(coefficients), -1)
    step = -(-exact.shape[1] // SAMPLED_PIXELS)
    exact = exact[:, ::step].astype(np.float64)
    codes = coded.array.reshape(len(coded.array), -1)[:, ::step]
    brightness = np.frombuffer(coded.fields["brightness"]["data"], "<f4")[::step]
    phase_rad = np.linspace(0.0, 2.0 * np.pi, SAMPLED_PHASES, endpoint=False)
    before = density(exact, phase_rad)
    after = density(decode_reflection16(codes, brightness), phase_rad)
    peak = before.max(axis=0)
    lit = peak > 0.0  # False for NaN
    if not lit.any():
        return 0.0, 0.0
    error = np.abs(after - before)[:, lit].max(axis=0) / peak[lit]
    return float(np.median(error)), float(error.max())


@dataclass(frozen=True, slots=True)
class Encoding:
    """One way to send an array in codes; writer and reader side by side."""

    name: str
    fits: Callable[[tuple[str, ...], str], bool]
    """Called as ``fits(axes, dtype)``: whether products like this can be sent so."""
    encode: Callable[[NDArray[Any]], Coded]
    """Returns the codes of an array and the fields that a decoder needs."""
    decode: Callable[[NDArray[Any], Mapping[str, Any]], NDArray[Any]]
    """Called as ``decode(codes, document)`` with the whole message; raises ProtocolError."""
    fields: Mapping[str, Mapping[str, Any]]
    """JSON schemas of those fields, by name."""
    dtype: str = "<u2"
    shape: Callable[[tuple[int, ...]], tuple[int, ...]] = lambda shape: shape
    """``dtype``, ``shape``: of the codes, for an array of a shape."""
    error: Callable[[NDArray[Any], Coded], tuple[float, float]] | None = None
    """Called as ``error(array, coded)``: median and maximum error of an approximate encoding; None
    for one without."""


_NUMBER: Final = {"type": "number"}

ENCODINGS: Final[dict[str, Encoding]] = {
    each.name: each
    for each in (
        Encoding(
            U16,
            fits=lambda axes, dtype: axes == ("y", "x") and dtype == "<f4",
            encode=encode_u16,
            decode=_decoded_u16,
            fields={"scale": _NUMBER, "offset": _NUMBER},
        ),
        Encoding(
            REFLECTION16,
            fits=lambda axes, dtype: axes == ("coefficient", "y", "x"),
            encode=encode_reflection16,
            decode=_decoded_reflection16,
            fields={"brightness": {"$ref": "#/components/schemas/array"}},
            shape=lambda shape: (shape[0] - 1, *shape[1:]),  # E is sent as brightness
            error=measured_error,
        ),
    )
}
"""Every encoding in codes by name, beside ``f32``, which sends values as they are."""


def encoding_names() -> tuple[str, ...]:
    """Return the names that a subscription may name."""
    return F32, *ENCODINGS
