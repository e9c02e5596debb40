"""Flags of pixels: biased, dark, saturated, not finite, replaced, contradictory, unexplained."""

from enum import IntFlag

import numpy as np

from transientcam_moments.arrays import Array, moment_planes, namespace
from transientcam_moments.moment_problem import smallest_eigenvalue


class Flags(IntFlag):
    """Bits of a pixel's flags, stored as uint8; 0 is a valid pixel that was not changed."""

    VALID = 0
    BIASED = 1
    """The moments had too little uniform part and were biased (Sec. 4.3).

    Few sharp returns leave none, and noise takes it from others: normal.
    """
    NO_SIGNAL = 2
    """No light: b_0 is not above the least brightness, or no other moment is above the noise, or
    above rounding where noise is not known: uniform light, or for m = 1 opposite returns."""
    SATURATED = 4
    """An image was at the end of its scale.

    What it would hold follows from the other images of the pixel; where it does not, the pixel has
    no moments and is NON_FINITE, too.
    """
    NON_FINITE = 8
    """A moment is NaN, infinite or so large that densities overflow its precision."""
    DEGENERATE = 16
    """The Toeplitz matrix is singular or indefinite, so that the density is not determined.

    By the estimators "unwrapped-phase" and "two-returns", which have no density: another range, or
    another pair of returns, explains the moments nearly as well, so that noise may have chosen
    between them.
    """
    REPLACED = 32
    """A bad pixel, which shows the mean of its neighbours."""
    CONTRADICTORY = 64
    """The moments contradict each other by more than noise explains: something is wrong.

    Gains that drifted or are of another camera, light that moved while it was captured, images that
    lost their synchronisation. Set only where the noise is known; never where b_0 is
    estimated, as that makes any moments agree.
    """
    UNEXPLAINED = 128
    """The returns found do not explain the moments: chi-square is above what noise exceeds in one
    pixel of a thousand.

    Light comes back in another way than the estimate assumes, and its range may be biased. Only the
    estimators "likelihood", "two-returns" and "unwrapped-phase" say so, and where the noise of the
    sensor is known.
    """


INVALID = Flags.NO_SIGNAL | Flags.NON_FINITE
"""A pixel with one of these has no range."""


def flags(b: Array, *, minimum_brightness: float = 0.0, eigenvalue: Array | None = None) -> Array:
    """Judge moments pixel by pixel.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments.
    minimum_brightness : float
        Pixels with b_0 at or below it have no signal, in the unit of b_0.
    eigenvalue : array, shape (...), optional
        Smallest eigenvalue of `b`, where it is at hand already.

    Returns
    -------
    array, shape (...), uint8
        Of `Flags`: NON_FINITE, NO_SIGNAL (also where b_1 to b_m are 0) and DEGENERATE. A pixel
        carries the first that applies.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers.
    """
    planes, trailing = moment_planes(b)
    xp = namespace(planes)
    smallest: Array = smallest_eigenvalue(planes) if eigenvalue is None else eigenvalue
    b0 = planes[0].real
    limits = np.finfo(b0.dtype)
    # biasing makes b_0 at most 2 m + 1 times the largest moment, a peak it 1 / (2 pi eps) times b_0
    largest = float(limits.max) * (6 * float(limits.eps) / (2 * len(planes) - 1))
    finite = xp.isfinite(planes[0].imag)
    for part in (b0, *(plane.real for plane in planes[1:]), *(plane.imag for plane in planes[1:])):
        finite = finite & (abs(part) < largest)
    # an eigenvalue is known to about eps times the order of the matrix
    rounding = 4 * len(planes) * float(limits.eps)
    dark = finite & ~((b0 > minimum_brightness) & (abs(planes[1:]).max(axis=0) > rounding * b0))
    degenerate = finite & ~dark & ~(smallest.reshape(-1) > rounding * b0)
    out = xp.where(finite, 0, int(Flags.NON_FINITE))
    out = xp.where(dark, int(Flags.NO_SIGNAL), out)
    out = xp.where(degenerate, int(Flags.DEGENERATE), out)
    return out.astype(xp.uint8).reshape(trailing)
