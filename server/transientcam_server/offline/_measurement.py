"""Reconstruction of a measurement in a file: the daemon's arithmetic without a camera.

An ``.npz`` of ``moments`` with ``base_frequency_hz``, or a file of impulse responses
(`offline.impulse_responses`), which are measured here with a modulation.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.errors import InputError
from transientcam_server.offline._impulse_responses import (
    LONGEST_S,
    arrays_of,
    impulse_response,
    require_some_finite,
    scalar,
)
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]

DEFAULT_FREQUENCY_HZ: Final = 23e6
DEFAULT_HARMONICS: Final = 4
MAX_HARMONICS: Final = 32
BLOCK_PIXELS: Final = 8192
_TIMES_B_0: Final = 1.5
"""What other moments may exceed b_0 by, with noise, in half of the pixels."""
_IMAGES: Final = ("range_m", "direct", "indirect", "uniform")


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """Moments of a scene, complex64 or complex128 (m+1, H, W), and the frequency they belong to."""

    moments: _Array
    base_frequency_hz: float

    @property
    def harmonics(self) -> int:
        """The order m."""
        return int(self.moments.shape[0]) - 1


@dataclass(frozen=True, slots=True, eq=False)
class TransientCube:
    """The result of `reconstruct_measurement`; its fields are the arrays of the file."""

    time_s: _Array
    """(T,), from 0 to one period, the period excluded."""
    density: _Array
    """(T, H, W), in the unit of the moments per second."""
    cumulative: _Array
    """(T, H, W), light up to each time."""
    range_m: _Array
    """(H, W), of the first return; NaN without one."""
    direct: _Array
    indirect: _Array
    uniform: _Array
    """``direct``, ``indirect``, ``uniform``: (H, W), weight of the first return, of the later ones,
    and spread evenly over all times."""
    flags: _Array
    """(H, W), `transientcam_moments.Flags`."""


def load_measurement(
    path: Path,
    *,
    frequency_hz: float | None = None,
    harmonics: int | None = None,
    background: Literal["none", "median"] = "none",
) -> Measurement:
    """Return the moments that a file holds or that follow from its impulse responses.

    ``frequency_hz``, ``harmonics``: for impulse responses, the modulation to measure them with (23
    MHz, 4); for moments, which have their own, at most as many harmonics as there are.
    ``background``: ``median`` subtracts each pixel's median from counts: photons that came at any
    time.
    Raises InputError naming the file, the key, what it is and what it must be; OSError if the file
    cannot be read.
    """
    arrays = arrays_of(path)
    if "moments" in arrays:
        return _of_moments(path, arrays, frequency_hz, harmonics)
    if frequency_hz is not None and not (np.isfinite(frequency_hz) and frequency_hz > 0.0):
        raise InputError("--frequency-hz", "value", f"{frequency_hz}", "a positive number")
    if harmonics is not None and not 1 <= harmonics <= MAX_HARMONICS:
        raise InputError("--harmonics", "value", f"{harmonics}", f"from 1 to {MAX_HARMONICS}")
    f_hz, m = frequency_hz or DEFAULT_FREQUENCY_HZ, harmonics or DEFAULT_HARMONICS
    time_s, response = impulse_response(path, arrays, background=background, highest_hz=f_hz * m)
    return Measurement(moments_of(response, time_s, frequency_hz=f_hz, harmonics=m), f_hz)


def moments_of(response: _Array, time_s: _Array, *, frequency_hz: float, harmonics: int) -> _Array:
    """Return the moments complex128 (m+1, H, W) of impulse responses (H, W, T).

    ``b_j = sum_k h_k exp(2 pi i j f t_k)``, the definition of Sec. 4 for a sum of impulses.
    """
    orders = np.arange(harmonics + 1)
    kernel = np.exp(2j * np.pi * frequency_hz * np.outer(time_s, orders))
    # row by row, so that a large half-precision cube is never held a second time in full
    rows = [np.asarray(row, dtype=np.float64) @ kernel for row in response]
    return np.ascontiguousarray(np.moveaxis(np.stack(rows), -1, 0))


def reconstruct_measurement(
    measurement: Measurement,
    *,
    bins: int,
    settings: ReconstructionSettings,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> TransientCube:
    """Reconstruct every pixel, block by block; ``progress`` takes pixels done and in all."""
    rad_s = 2.0 * np.pi * measurement.base_frequency_hz
    time_s = 2.0 * np.pi * np.arange(bins) / (bins * rad_s)
    chosen = settings.for_moments(base_frequency_hz=measurement.base_frequency_hz)
    # smoothing needs neighbours, so it comes before the pixels are taken apart
    smoothed = tm.Reconstruction(measurement.moments, chosen).smoothed
    height, width = smoothed.shape[1:]
    flat = smoothed.reshape(smoothed.shape[0], -1)
    pixels = flat.shape[1]
    real = np.float32 if flat.dtype == np.complex64 else np.float64
    density, cumulative = (np.empty((bins, pixels), dtype=real) for _ in range(2))
    images: dict[str, _Array] = {name: np.empty(pixels, dtype=real) for name in _IMAGES}
    images["flags"] = np.empty(pixels, dtype=np.uint8)
    for block in _blocks(pixels, bins):
        found = tm.Reconstruction(flat[:, block], chosen)
        density[:, block] = rad_s * tm.density(found.coefficients, rad_s * time_s)
        cumulative[:, block] = tm.cumulative(found.coefficients, rad_s * time_s)
        for name, image in images.items():
            image[block] = getattr(found, name)
        progress(block.stop, pixels)
    shape = (height, width)
    return TransientCube(
        time_s=time_s,
        density=density.reshape(bins, *shape),
        cumulative=cumulative.reshape(bins, *shape),
        **{name: image.reshape(shape) for name, image in images.items()},
    )


def save_cube(path: Path, cube: TransientCube) -> None:
    """Write a cube as ``.npz``, whole or not at all."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as file:
            np.savez(file, **{name: getattr(cube, name) for name in TransientCube.__slots__})
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _blocks(pixels: int, bins: int) -> Iterator[slice]:
    """Yield slices of pixels, few enough that a block's density stays small."""
    step = max(1, min(BLOCK_PIXELS, BLOCK_PIXELS * 64 // bins))
    for start in range(0, pixels, step):
        yield slice(start, min(start + step, pixels))


def _of_moments(
    path: Path, arrays: Mapping[str, _Array], frequency_hz: float | None, harmonics: int | None
) -> Measurement:
    moments = arrays["moments"]
    if moments.ndim == 1:
        moments = moments[:, np.newaxis, np.newaxis]
    if moments.ndim != 3 or not 2 <= moments.shape[0] <= MAX_HARMONICS + 1 or not moments.size:
        raise InputError(
            str(path), "moments", f"of shape {arrays['moments'].shape}", "(m+1, H, W), m = 1 to 32"
        )
    if moments.dtype.kind not in "cfiu":
        raise InputError(str(path), "moments", f"{moments.dtype}", "complex numbers")
    f_hz = scalar(path, arrays, "base_frequency_hz")
    if f_hz * LONGEST_S < 1.0:
        least = f"at least {1.0 / LONGEST_S:g} Hz"
        raise InputError(str(path), "base_frequency_hz", f"{f_hz:g} Hz", least)
    if frequency_hz is not None and frequency_hz != f_hz:
        raise InputError(
            "--frequency-hz", "value", f"{frequency_hz:g}", f"the {f_hz:g} of these moments"
        )
    m = moments.shape[0] - 1
    if harmonics is not None and not 1 <= harmonics <= m:
        raise InputError("--harmonics", "value", f"{harmonics}", f"from 1 to {m}, as in {path}")
    moments = moments[: (harmonics or m) + 1]
    dtype = np.complex64 if moments.dtype == np.complex64 else np.complex128
    moments = np.ascontiguousarray(moments, dtype=dtype)
    require_some_finite(path, "moments", moments)
    light, largest = np.abs(moments[0]), np.abs(moments[1:]).max(axis=0)
    lit = np.isfinite(moments).all(axis=0) & (largest > 0.0)
    strange = (moments[0].real < light / _TIMES_B_0) | (largest > light * _TIMES_B_0)
    if lit.any() and (share := strange[lit].mean()) > 0.5:
        found = f"without a b_0 in {share:.0%} of the pixels"
        expected = "(m+1, H, W), b_0 first, which is real and no smaller than the others"
        raise InputError(str(path), "moments", found, expected)
    return Measurement(moments, f_hz)
