"""What every algorithm needs of its arrays: their namespace, their shape, and blocks of pixels.

Arrays are planes first and pixels last. An algorithm is written over complex planes, one
contiguous one-dimensional view per moment, and works on NumPy, JAX and CuPy arrays alike. NumPy
gets the pixels in blocks that stay in cache, which is several times faster than whole images.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from transientcam_moments.errors import ParameterError, ShapeError

Array: TypeAlias = Any
"""A NumPy, JAX or CuPy array; the array API gives no common type to check against."""

MAX_HARMONICS = 32
MAX_MULTIPLE = 1 << 16
"""Of the base frequency, where one return is looked for within a range that is stated."""
BLOCK_PIXELS = 8192


def namespace(array: Array) -> Any:
    """Return the module whose functions work on `array`: numpy, jax.numpy, cupy."""
    get = getattr(array, "__array_namespace__", None)
    return np if get is None else get()


def as_array(values: Array) -> Array:
    """Return `values` as it is when it is an array, else as a NumPy array; in native byte order.

    What NumPy masks is NaN, and whole numbers become real ones for it.
    """
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.result_type(values.dtype, np.float32)), np.nan)
    array = values if hasattr(values, "__array_namespace__") else np.asarray(values)
    if isinstance(array, np.ndarray) and not array.dtype.isnative:  # as FITS and HDF5 keep them
        return array.astype(array.dtype.newbyteorder("="))
    return array


def moment_planes(b: Array, *, name: str = "b") -> tuple[Array, tuple[int, ...]]:
    """Validate trigonometric moments and flatten their pixels.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Complex (or real) moments, 1 <= m <= 32.

    Returns
    -------
    planes : array, shape (m + 1, pixels), complex64 or complex128
    trailing : tuple of int
        The shape of the pixels, to give results their shape back.

    Raises
    ------
    ShapeError
        When there are not 2 to 33 planes or the elements are not numbers.
    """
    b = as_array(b)
    if b.ndim < 1 or not 2 <= b.shape[0] <= MAX_HARMONICS + 1:
        raise ShapeError(name, f"of shape {tuple(b.shape)}", "planes b_0..b_m first, m in 1..32")
    return flat_planes(_as_complex(b, name)), tuple(b.shape[1:])


def flat_planes(array: Array) -> Array:
    """Return the array with all axes after the first made one, each plane contiguous."""
    flat = array.reshape((array.shape[0], math.prod(array.shape[1:])))
    return np.ascontiguousarray(flat) if namespace(array) is np else flat


def _as_complex(b: Array, name: str) -> Array:
    xp = namespace(b)
    if b.dtype in (xp.complex64, xp.complex128):
        return b
    if b.dtype == xp.float32:
        return b.astype(xp.complex64)
    if np.dtype(b.dtype).kind not in "iuf":
        raise ShapeError(name, f"of type {b.dtype}", "complex64 or complex128")
    return b.astype(xp.complex128)


def real_type(b: Array) -> Any:
    """Return the real element type that belongs to the complex or real array `b`."""
    return np.empty(0, b.dtype).real.dtype


def phases(phase_rad: Array, *, like: Array) -> Array:
    """Return phases as a one-dimensional real array in the namespace and precision of `like`.

    Raises ShapeError when there is more than one axis or the elements are not real numbers.
    """
    xp = namespace(like)
    array = as_array(phase_rad)
    if array.ndim > 1 or np.dtype(array.dtype).kind not in "iuf":
        found = f"of shape {tuple(array.shape)} and type {array.dtype}"
        raise ShapeError("phase_rad", found, "one axis of real numbers")
    return xp.asarray(array).reshape(-1)


def in_range(field: str, value: float, low: float, high: float, limit: str) -> float:
    """Return `value` when low <= value <= high, else raise a ParameterError."""
    if not low <= value <= high:
        raise ParameterError(field, value, limit)
    return value


def chosen(field: str, value: str, allowed: Sequence[str]) -> str:
    """Return `value` when it is one of `allowed`, else raise a ParameterError."""
    if value not in allowed:
        raise ParameterError(field, value, "one of " + ", ".join(allowed))
    return value


def by_blocks(
    function: Callable[..., tuple[Array, ...]], *arrays: Array, pixels: int = BLOCK_PIXELS
) -> tuple[Array, ...]:
    """Apply a planar function to blocks of pixels and put its results together.

    Parameters
    ----------
    function : callable
        Takes slices of the arrays, returns a tuple of arrays with pixels last.
    *arrays : array, shape (..., P)
        Pixels last, the same number of pixels in each.
    pixels : int
        Pixels in a block.

    Returns
    -------
    tuple of array
    """
    total = arrays[0].shape[-1]
    if namespace(arrays[0]) is not np or total <= pixels:
        return function(*arrays)
    results: list[np.ndarray[Any, Any]] = []
    for start in range(0, total, pixels):
        block = function(*(array[..., start : start + pixels] for array in arrays))
        if not results:
            results = [np.empty((*part.shape[:-1], total), part.dtype) for part in block]
        for result, part in zip(results, block, strict=True):
            result[..., start : start + pixels] = part
    return tuple(results)


def squared(z: Array) -> Array:
    """Return |z|^2 without a square root."""
    return z.real * z.real + z.imag * z.imag


def parts(b: Array) -> tuple[list[Array], list[Array]]:
    """Return real and imaginary parts of complex planes, each contiguous in NumPy."""
    if namespace(b) is not np:
        return [plane.real for plane in b], [plane.imag for plane in b]
    real, imag = np.ascontiguousarray(b.real), np.ascontiguousarray(b.imag)
    return list(real), list(imag)


def in_turn(angle: Array) -> Array:
    """Bring angles in [-pi, 2 pi] to [0, 2 pi), also after rounding to their precision."""
    xp = namespace(angle)
    angle = xp.where(angle < 0, angle + 2 * np.pi, angle)
    return xp.where(angle >= np.asarray(2 * np.pi, angle.dtype), 0 * angle, angle)


def to_complex(real: Array, imag: Array) -> Array:
    """Return real + i imag in the precision of its parts."""
    xp = namespace(real)
    if xp is not np:  # where nothing is computed here, it has its own
        return xp.to_complex(real, imag) if hasattr(xp, "to_complex") else real + 1j * imag
    out = np.empty(real.shape, np.result_type(real.dtype, np.complex64))
    out.real = real
    out.imag = imag
    return out


def some(mask: Array) -> bool:
    """Say whether a branch for `mask` is needed; always, where the values are not known yet."""
    return bool(mask.any()) if isinstance(mask, np.ndarray) else True
