"""Times of flight as the frequencies of the signal over modulation frequency."""

import numpy as np

from transientcam_moments.arrays import Array, by_blocks, in_range
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first
from transientcam_moments.comparisons._weights import nonnegative_weights
from transientcam_moments.errors import ParameterError

_LEAST = 3
_PADDED = 1024
_BLOCK_PIXELS = 1024


def frequency_domain(b: Array, *, returns: int = 2, threshold: float = 0.1) -> SparseEstimate:
    """Estimate returns from the peaks of the Fourier transform of b_1 .. b_m over frequency.

    m is at least 3, and better 16 or 32.

    Parameters
    ----------
    returns : int
        The most that are looked for.
    threshold : float
        Peaks lower than this share of the highest one don't count, 0 to 1.

    Notes
    -----
    Swept over frequency a return of time of flight tau is an oscillation of frequency tau, as in
    optical coherence tomography. The transform is taken of the analytic signal b_j under a Hann
    window; peaks are refined by a parabola through the logarithms, weights follow by non-negative
    least squares.
    """
    pixels = pixels_of(b, least=_LEAST, name="frequency-domain")
    if not 1 <= returns <= pixels.m:
        raise ParameterError("returns", returns, f"1 to m = {pixels.m}")
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    c = pixels.b[1:]
    (phase,) = by_blocks(lambda part: (_peaks(part, returns, threshold),), c, pixels=_BLOCK_PIXELS)
    weight = nonnegative_weights(c, np.arange(1.0, len(c) + 1), phase)
    return pixels.sparse(phase, weight)


def _peaks(c: Complex, returns: int, threshold: float) -> Real:
    """Return the phases (K, P) of the highest peaks, NaN where there are fewer."""
    m = len(c)
    window = np.sin(np.pi * np.arange(1, m + 1) / (m + 1)) ** 2
    spectrum = np.abs(np.fft.fft(window[:, None] * c, _PADDED, axis=0))
    before, after = np.roll(spectrum, 1, axis=0), np.roll(spectrum, -1, axis=0)
    peak = (spectrum > before) & (spectrum >= after)
    heights = np.where(peak, spectrum, 0)
    order = np.argsort(-heights, axis=0)[:returns]
    height = np.take_along_axis(heights, order, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        left, top, right = (
            np.log(np.take_along_axis(part, order, axis=0)) for part in (before, spectrum, after)
        )
        bend = left - 2 * top + right
        offset = np.where(bend < 0, 0.5 * (left - right) / bend, 0)
    there = (height > 0) & (height >= threshold * height[0])
    found: Real = np.where(there, (order + offset) * (2 * np.pi / _PADDED), np.nan)
    return found


TECHNIQUE = Technique(
    **TEXTS["frequency-domain"],
    harmonics=from_first,
    least_harmonics=_LEAST,
    estimate=frequency_domain,
)
