"""Sums of opposite images, which are the same at every frequency (Sec. 3.1)."""

from typing import NamedTuple

import numpy as np

from transientcam_moments.arrays import Array

PHASE_STEPS = 4
_LEAST_PIXELS = 64
_SUSPICIOUS = 1.5  # times the usual deviation of a sum: many standard errors of the first look
_LIT = 0.25  # of the amplitude that a tenth of the pixels exceed


class PairSums(NamedTuple):
    """Sums of opposite images of one take, in some of the pixels.

    Attributes
    ----------
    pixels : integer array, shape (P,)
        Which pixels of the flat images.
    values : array, shape (N, P)
        All images there, float32; float64 for such images.
    earlier : integer array, shape (S,)
        Of each pair of opposite images the earlier one; the other comes two images later.
    sums : array, shape (S, P)
        Of each pair.
    typical : array, shape (S,)
        Median over the pixels of the distance from the median of all sums.
    rounding : float
        By how much a sum may be off without any noise: whole numbers are rounded to 1/2 each.
    """

    pixels: Array
    values: Array
    earlier: Array
    sums: Array
    typical: Array
    rounding: float

    @property
    def suspicious(self) -> Array:
        """Which sums (S,) deviate more than half of them do among themselves."""
        usual = np.sort(self.typical)[(len(self.typical) - 1) // 2]
        return self.typical > _SUSPICIOUS * usual + self.rounding


def pair_sums(images: Array, first: int, *, most: int, full_scale: float) -> PairSums | None:
    """Add up opposite images, in lit pixels spread over the sensor.

    Parameters
    ----------
    images : array, shape (N, ...)
        Images of one take, real numbers.
    first : int
        Where those at four phase steps begin.
    most : int
        So many pixels are looked at, of which the lit ones are used.
    full_scale : float
        Pixels that reach it in any image are not used: where an image is cut off, so are sums.

    Returns
    -------
    PairSums or None
        None with fewer than three sums, of which none could be called the wrong one, another number
        of images than a capture has, or too few pixels with light.

    Notes
    -----
    Medians over pixels: what moves in less than half of them decides nothing.
    """
    flat = images.reshape((len(images), -1))
    if len(flat) < first + 2 * PHASE_STEPS or (len(flat) - first) % PHASE_STEPS:
        return None
    step = max(1, flat.shape[1] // most) | 1  # odd, so that all columns of common sizes have a turn
    values = flat[:, ::step].astype(np.float64 if images.dtype == np.float64 else np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        amplitude = _opposite(values, first, np.subtract)
        amplitude = np.abs(amplitude, out=amplitude).sum(axis=0)
    usable = (values.max(axis=0) < full_scale) & np.isfinite(amplitude)
    count = int(np.count_nonzero(usable))
    if count < _LEAST_PIXELS:
        return None
    tenth = count - 1 - count // 10
    bright = np.partition(amplitude[usable], tenth)[tenth]
    lit = np.flatnonzero(usable & (amplitude >= _LIT * bright))
    values = values.take(lit, axis=1)
    sums = _opposite(values, first, np.add)
    pairs = np.arange(len(sums))
    deviation = sums - _middle(sums, 0)
    rounding = 8 * float(np.finfo(sums.dtype).eps) * float(values.max(initial=0.0))
    if np.issubdtype(images.dtype, np.integer):
        rounding = max(1.0, rounding)
    return PairSums(
        lit * step,
        values,
        first + PHASE_STEPS * (pairs // 2) + pairs % 2,
        sums,
        _middle(np.abs(deviation, out=deviation), 1),
        rounding,
    )


def _opposite(values: Array, first: int, combine: np.ufunc) -> Array:
    """Combine opposite images: (S, P), pairs in order of time."""
    phased = values[first:].reshape((-1, PHASE_STEPS, values.shape[1]))
    pairs: Array = combine(phased[:, :2], phased[:, 2:])
    return pairs.reshape((-1, values.shape[1]))


def _middle(values: Array, axis: int) -> Array:
    """Return the median along an axis; of an even number the lower one, which is faster."""
    at = (values.shape[axis] - 1) // 2
    return np.partition(values, at, axis=axis).take(at, axis=axis)
