"""One return from a phase: of one frequency, as any AMCW lidar camera takes it, or of high ones."""

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import SparseEstimate
from transientcam_moments.comparisons._pixels import pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique


def single_frequency(b: Array) -> SparseEstimate:
    """Estimate one return at arg b_1 of weight |b_1|; nothing else is looked at."""
    pixels = pixels_of(b, least=1, name="single-frequency", last=1)
    first = pixels.b[1:2]
    return pixels.sparse(np.angle(first), np.abs(first))


SINGLE_FREQUENCY = Technique(
    **TEXTS["single-frequency"],
    harmonics=lambda m: (1,),
    least_harmonics=1,
    estimate=single_frequency,
)


_LEAST = 2


def high_frequency(b: Array) -> SparseEstimate:
    """Estimate one return, of weight |b_m|, from b_{m-1} and b_m, m >= 2.

    The beat of the two, arg(b_m conj(b_{m-1})), has no ambiguity within the turn and chooses among
    the m phases that b_m alone allows; it may be off by pi / m. The frequencies are high where
    m f is above the bandwidth of the indirect light.
    """
    pixels = pixels_of(b, least=_LEAST, name="high-frequency", first=-2)
    m, low, high = pixels.m, pixels.b[-2], pixels.b[-1]
    beat = np.angle(high * low.conj())
    turns = np.round((m * beat - np.angle(high)) / (2 * np.pi))
    phase = (np.angle(high) + 2 * np.pi * turns) / m
    return pixels.sparse(phase[None], np.abs(high)[None])


HIGH_FREQUENCY = Technique(
    **TEXTS["high-frequency"],
    harmonics=lambda m: (m - 1, m),
    least_harmonics=_LEAST,
    estimate=high_frequency,
)
