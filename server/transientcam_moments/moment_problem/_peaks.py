"""Local maxima of the maximum entropy density: the range estimate of Sec. 5.3."""

from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    Array,
    bank,
    by_blocks,
    flat_planes,
    in_range,
    namespace,
    parts,
    summary,
)
from transientcam_moments.moment_problem import _maxima as maxima
from transientcam_moments.moment_problem._levinson import Coefficients

PEAK_THRESHOLD = 0.1
"""A peak counts when the density in it is at least this share of the highest one's."""

_BLOCK_PIXELS = 32768  # the steps are many and short: calls cost more than misses of the cache


class Peaks(NamedTuple):
    """Local maxima of a density.

    Attributes
    ----------
    first_rad : array, shape (...)
        Phase of the first one above the threshold, in [0, 2 pi); NaN where there is none.
    strongest_rad : array, shape (...)
        Phase of the highest one; NaN where there is none.
    phase_rad : array, shape (m, ...)
        All above the threshold, ascending; NaN in unused slots, which come last.
    density : array, shape (m, ...)
        The density there, in the unit of b_0 per radian; 0 in unused slots.
    """

    first_rad: Array
    strongest_rad: Array
    phase_rad: Array
    density: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def peaks(coefficients: Coefficients, *, threshold: float = PEAK_THRESHOLD) -> Peaks:
    """Find the local maxima of the density of every pixel.

    Parameters
    ----------
    coefficients : Coefficients
        Of order m.
    threshold : float
        Peaks lower than this share of the highest one don't count, 0 to 1.

    Returns
    -------
    Peaks
        At most m of them. A uniform density, a dark and an invalid pixel have none.

    Raises
    ------
    ParameterError
        For a threshold outside of 0 to 1.

    Notes
    -----
    Sec. 5.3. The search climbs from the angles of the density's poles, of which one lies in the
    basin of each peak, with Newton's method on the logarithm of the density where that is concave.
    """
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    first, strongest, phase, height = _found(
        flat_planes(coefficients.polynomial),
        flat_planes(coefficients.reflection),
        coefficients.error.reshape(-1),
        threshold,
        spread=on_threads(None),
    )
    m, trailing = len(phase), coefficients.error.shape
    return Peaks(
        first.reshape(trailing),
        strongest.reshape(trailing),
        phase.reshape((m, *trailing)),
        height.reshape((m, *trailing)),
    )


@accelerated("peaks")
def _found(a: Array, reflection: Array, error: Array, threshold: float) -> tuple[Array, ...]:
    def find(a: Array, reflection: Array, error: Array) -> tuple[Array, ...]:
        return _peaks(a, reflection, error, threshold)

    return by_blocks(find, a, reflection, error, pixels=_BLOCK_PIXELS)


def _peaks(a: Array, reflection: Array, error: Array, threshold: float) -> tuple[Array, ...]:
    """Do as `peaks` does with planes: polynomial (m + 1, P), reflection (m, P), error (P)."""
    xp, order = namespace(a), (0,) * reflection.shape[0]
    phases, heights = bank(error, order, 0), bank(error, order, 0)
    starts = maxima.start_angles(len(order), error.dtype)
    with np.errstate(all="ignore"):
        polynomial, coefficients = parts(a), parts(reflection)
        maxima.peaks(order, starts, threshold, error, *polynomial, *coefficients, phases, heights)
    height = xp.stack(heights)
    phase, highest = xp.stack(phases), maxima.strongest(order, phases, heights)
    return (
        xp.where(height[0] > 0, phase[0], np.nan),
        xp.where(height[0] > 0, highest, np.nan),
        xp.where(height > 0, phase, np.nan),
        height,
    )
