"""What every technique does before and after: pixels in a row, of a common scale, and back."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import Array, in_turn, moment_planes
from transientcam_moments.comparisons._estimate import GridEstimate, Real, SparseEstimate
from transientcam_moments.errors import ParameterError

Complex = NDArray[np.complexfloating[Any, Any]]


@dataclass(frozen=True, slots=True)
class Pixels:
    """Moments of pixels that can be computed with.

    Attributes
    ----------
    b : array, shape (m + 1, P), complex128
        The largest of the moments that are looked at is 1; all 0 where a pixel cannot be used.
    usable : boolean array, shape (P)
        Where those moments are finite and not all zero.
    scale : array, shape (P)
        What b was divided by, in the unit of the moments; 0 where a pixel cannot be used.
    trailing : tuple of int
        The shape of the pixels.
    """

    b: Complex
    usable: NDArray[np.bool_]
    scale: Real
    trailing: tuple[int, ...]
    _dtype: Any

    @property
    def m(self) -> int:
        """The order of the moments."""
        return int(self.b.shape[0]) - 1

    def require_bins(self, bins: int) -> None:
        """Raise a ParameterError where there are no more than 2 m bins of phase."""
        if bins <= 2 * self.m:
            raise ParameterError("bins", bins, f"more than {2 * self.m}")

    def sparse(self, phase_rad: Real, weight: Real, uniform: Real | None = None) -> SparseEstimate:
        """Return found returns (K, P) of these pixels, sorted and in the unit of the moments.

        Those without a phase, or without a weight above the rounding of the moments, are none.
        """
        floor = 4 * self.b.shape[0] * float(np.finfo(self._dtype).eps)
        with np.errstate(invalid="ignore"):
            used = self.usable & np.isfinite(phase_rad) & (weight > floor) & (weight < np.inf)
        phase = np.where(used, np.remainder(np.where(used, phase_rad, 0), 2 * np.pi), np.nan)
        scaled = np.where(used, weight, 0) * self.scale
        order = np.argsort(phase, axis=0)
        phase = in_turn(np.take_along_axis(phase, order, axis=0).astype(self._dtype))
        with np.errstate(over="ignore", under="ignore"):
            light = np.take_along_axis(scaled, order, axis=0).astype(self._dtype)
            rest = np.zeros_like(self.scale) if uniform is None else uniform * self.scale
        phase = np.where(light > 0, phase, np.nan)  # rounding may take the faintest away
        shape = (phase.shape[0], *self.trailing)
        return SparseEstimate(
            phase.reshape(shape),
            light.reshape(shape),
            rest.astype(self._dtype).reshape(self.trailing),
        )

    def grid(self, density: Real) -> GridEstimate:
        """Return a density (T, P) of these pixels, in the unit of the moments per radian."""
        scaled = np.where(self.usable, density, 0) * self.scale
        with np.errstate(over="ignore", under="ignore"):
            cast = scaled.astype(self._dtype)
        return GridEstimate(cast.reshape((cast.shape[0], *self.trailing)))


def pixels_of(
    b: Array, *, least: int, name: str, first: int = 1, last: int | None = None
) -> Pixels:
    """Prepare moments (m + 1, ...) for a technique.

    Parameters
    ----------
    least
        The smallest m it works with.
    name
        The technique, for the error.
    first, last
        The moments that it looks at, as a slice; the others may be anything.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers.
    ParameterError
        When there are too few moments.
    """
    planes, trailing = moment_planes(b)
    check_order(planes.shape[0] - 1, least=least, name=name)
    wide = np.array(planes, dtype=np.complex128)
    seen = wide[first : None if last is None else last + 1]
    with np.errstate(over="ignore", invalid="ignore"):
        scale = np.maximum(np.abs(seen.real), np.abs(seen.imag)).max(axis=0)
    usable = np.isfinite(seen).all(axis=0) & (scale > 0)
    scale = np.where(usable, scale, 0.0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        wide = np.where(usable, wide / scale, 0)
    dtype = np.float32 if planes.dtype == np.complex64 else np.float64
    return Pixels(wide, usable, scale, trailing, dtype)


def check_order(m: int, *, least: int, name: str) -> None:
    """Raise a ParameterError when a technique has too few moments."""
    if m < least:
        raise ParameterError("harmonics", m, f"at least {least} for the estimator {name}")
