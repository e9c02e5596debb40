"""The truth of a simulated scene, in the quantities that are measured."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Truth

_Array = NDArray[Any]
LEAST_LIGHT: Final = 0.01
"""Light of a pixel that is compared, over that of the median pixel with any."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Some pixels with all of their light."""

    y: _Array
    x: _Array
    """``y``, ``x``: (P) indices."""
    light: tuple[tuple[_Array, _Array], ...]
    """Of each pixel, times of flight in s and the share of its light that comes back at each."""


def sample_pixels(truth: Truth, *, pixels: int, seed: int) -> Sample:
    """Choose pixels that light comes back to; every such pixel with the same chance.

    Errors are shares of a pixel's own light. Of what turns its edge to the camera a thousandth of a
    DN may come back, where smoothing leaves light of the neighbours: one such pixel in 400 would be
    the mean of all.
    """
    lit = np.isfinite(truth.range_m) & (truth.brightness > 0)
    least = LEAST_LIGHT * np.median(truth.brightness[lit]) if lit.any() else 0.0
    y, x = np.nonzero(lit & (truth.brightness >= least))
    chosen = np.random.default_rng(seed).permutation(len(y))[:pixels]
    y, x = y[chosen], x[chosen]
    light = []
    for row, column in zip(y.tolist(), x.tolist(), strict=True):
        time_s, value = truth.impulse_response(column, row)
        # a density over equal bins, or the returns' weights: only their shares matter
        light.append((time_s, value / value.sum()))
    return Sample(y, x, tuple(light))


def cumulative(sample: Sample, phase_rad: _Array, *, base_frequency_hz: float) -> _Array:
    """Return the share of the light (T, P) that has come back until each phase, in [0, 2 pi)."""
    result = np.empty((len(phase_rad), len(sample.light)))
    for pixel, (time_s, share) in enumerate(sample.light):
        phase = np.remainder(2 * np.pi * base_frequency_hz * time_s, 2 * np.pi)
        order = np.argsort(phase)
        summed = np.append(0.0, np.cumsum(share[order]))
        result[:, pixel] = summed[np.searchsorted(phase[order], phase_rad, side="right")]
    return result


def count_returns(weight: _Array, *, threshold: float) -> _Array:
    """Count returns (K, ...) of at least a share of each pixel's strongest one."""
    strongest = weight.max(axis=0)
    counted: _Array = ((weight >= threshold * strongest) & (weight > 0)).sum(axis=0)
    return counted
