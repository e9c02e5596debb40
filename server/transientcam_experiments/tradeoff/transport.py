"""Bytes and delay against added error: how a range or a density can be sent."""

import io
import time
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import transientcam_moments as tm

_Array = NDArray[Any]
_Clock = Callable[[], float]
_BINS: Final = 128

QUANTITIES: Final[dict[str, str]] = {
    "bytes": "size of one frame",
    "seconds": "time to encode and to decode one frame, median",
    "error_median": "added error of a typical pixel: m for a range; for a density, of the light "
    "until any time, as a share of the brightness",
    "error_worst": "added error of the worst pixel",
}


@dataclass(frozen=True, slots=True)
class Coding:
    """A way to send a product: to bytes and back."""

    point: Mapping[str, Any]
    encode: Callable[[_Array], bytes]
    decode: Callable[[bytes, tuple[int, ...]], _Array]


def codings(harmonics: int) -> Iterator[Coding]:
    """Yield every way that is measured; densities travel as b_0 and reflection coefficients."""
    for product, dtype in (("range", "f4"), ("range", "f2"), ("coefficients", "f4")):
        yield _plain(product, dtype, harmonics)
    yield Coding(
        {"product": "range", "coding": "png, 16 bits of 1 mm", "harmonics": harmonics},
        _to_png,
        _from_png,
    )
    yield Coding(
        {"product": "range", "coding": "f32, deflated", "harmonics": harmonics},
        lambda array: zlib.compress(array.astype("<f4").tobytes(), 1),
        lambda data, shape: np.frombuffer(zlib.decompress(data), "<f4").reshape(shape),
    )
    yield _plain("coefficients", "f2", harmonics)
    for bits in (16, 8):
        yield Coding(
            {
                "product": "coefficients",
                "coding": f"reflections, {bits} bits",
                "harmonics": harmonics,
            },
            partial(_to_reflections, bits=bits),
            partial(_from_reflections, bits=bits),
        )


def measure(
    coding: Coding,
    b: _Array,
    range_m: _Array,
    *,
    repetitions: int,
    clock: _Clock = time.perf_counter,
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Return size, time and error of one way to send a frame."""
    if coding.point["product"] == "range":
        array = range_m.astype(np.float32)
    else:
        array = _planes(tm.levinson(b.astype(np.complex64)))
    data = coding.encode(array)
    back = coding.decode(data, array.shape)
    times = []
    for _ in range(repetitions):
        begin = clock()
        coding.decode(coding.encode(array), array.shape)
        times.append(clock() - begin)
    if coding.point["product"] == "range":
        off = np.abs(back.astype(float) - array)
    else:
        off = _light_error(array, back)
    off = off[np.isfinite(off)]
    values: dict[str, float | None] = {
        "bytes": float(len(data)),
        "seconds": float(np.median(times)),
        "error_median": float(np.median(off)),
        "error_worst": float(off.max()),
    }
    spread: dict[str, float | None] = dict.fromkeys(values)
    spread["seconds"] = float(np.std(times, ddof=1)) if repetitions > 1 else None
    return values, spread


def _plain(product: str, dtype: str, harmonics: int) -> Coding:
    name = {"f4": "f32", "f2": "f16"}[dtype]
    return Coding(
        {"product": product, "coding": name, "harmonics": harmonics},
        lambda array: array.astype(f"<{dtype}").tobytes(),
        lambda data, shape: np.frombuffer(data, f"<{dtype}").reshape(shape).astype(np.float32),
    )


def _to_png(range_m: _Array) -> bytes:
    steps = np.clip(np.nan_to_num(np.rint(range_m * 1e3)), 0, 65535).astype(np.uint16)
    file = io.BytesIO()
    Image.fromarray(steps).save(file, "PNG", compress_level=1)
    return file.getvalue()


def _from_png(data: bytes, shape: tuple[int, ...]) -> _Array:
    with Image.open(io.BytesIO(data)) as image:
        steps = np.asarray(image).reshape(shape)
    return np.where(steps == 0, np.float32(np.nan), steps / np.float32(1e3))


def _planes(coefficients: tm.Coefficients) -> _Array:
    """Lay out as the product `coefficients`: E, then the parts of a_1 .. a_m."""
    planes = [np.asarray(coefficients.error)]
    for plane in np.asarray(coefficients.polynomial)[1:]:
        planes += [plane.real, plane.imag]
    return np.stack(planes)


def _of_planes(planes: _Array) -> tm.Coefficients:
    polynomial = np.concatenate(
        [np.ones((1, *planes.shape[1:])), planes[1::2] + 1j * planes[2::2]]
    ).astype(np.complex128)
    return tm.Coefficients(planes[0].astype(float), polynomial, _reflections(planes))


def _reflections(planes: _Array) -> _Array:
    """Step down from order to order: g_m = a_m, and so on with one order less."""
    a = (planes[1::2] + 1j * planes[2::2]).astype(np.complex128)
    found = np.empty_like(a)
    for k in range(len(a) - 1, -1, -1):
        found[k] = g = a[k]
        lower = (a[:k] - g * a[:k][::-1].conj()) / np.maximum(1 - np.abs(g) ** 2, 1e-12)
        a = lower
    return found


def _to_reflections(planes: _Array, bits: int) -> bytes:
    """Write b_0 as f32; of each g the angle and atanh |g|, which spends its steps close to 1."""
    g = _reflections(planes)
    b0 = planes[0] / np.prod(np.maximum(1 - np.abs(g) ** 2, 1e-12), axis=0)
    top = 2**bits - 1
    size = np.arctanh(np.minimum(np.abs(g), 1 - 1e-7)) / np.arctanh(1 - 1e-7)
    turn = np.remainder(np.angle(g) / (2 * np.pi), 1.0)
    dtype = "<u2" if bits == 16 else "|u1"
    codes = [np.rint(size * top).astype(dtype), (np.rint(turn * (top + 1)) % (top + 1))]
    parts = [b0.astype("<f4").tobytes(), *(code.astype(dtype).tobytes() for code in codes)]
    return b"".join(parts)


def _from_reflections(data: bytes, shape: tuple[int, ...], bits: int) -> _Array:
    pixels, m = shape[1:], (shape[0] - 1) // 2
    count, top = int(np.prod(pixels)), 2**bits - 1
    b0 = np.frombuffer(data, "<f4", count).reshape(pixels)
    dtype = "<u2" if bits == 16 else "|u1"
    codes = np.frombuffer(data, dtype, offset=4 * count).reshape((2, m, *pixels)).astype(float)
    size = np.tanh(codes[0] / top * np.arctanh(1 - 1e-7))
    g = size * np.exp(2j * np.pi * codes[1] / (top + 1))
    return _planes(tm.from_reflection(b0.astype(float), g))


def _light_error(sent: _Array, back: _Array) -> _Array:
    """Largest difference of the cumulative densities, over the brightness that was sent."""
    phase = 2 * np.pi * np.arange(1, _BINS + 1) / _BINS
    with np.errstate(all="ignore"):
        summed = [np.asarray(tm.cumulative(_of_planes(each), phase)) for each in (sent, back)]
        error: _Array = np.abs(summed[1] - summed[0]).max(axis=0) / summed[0].max(axis=0)
    return error
