"""Where the light of a pixel may begin: the ranges that its moments do not contradict.

Moments of a few frequencies are explained by several returns as well as by one whose light goes on
coming, out of the material or from other walls, and each explanation begins at another range. Which
of them is true no chi-square tells: all that noise explains are possible.

A pixel's light is taken for a sharp return w and a tail v that begins with it,

    b_j = exp(i j phi) (w + v q_j),  w, v >= 0,

whose density is that of a gamma distribution, q_j = (1 - i j omega tau / p)^-p, or exponential and
widened by a normal distribution as of light that enters a material (Heide et al. 2014, the paper's
Fig. 11), q_j = exp(-(j omega sigma)^2 / 2) / (1 - i j omega tau). Every shape is fitted by weighted
least squares, phi on a grid; angles are those of the highest harmonic, so that the grid serves all
frequencies.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_moments.likelihood.chi_square import SIGNIFICANCE, chi_square_quantile

_Array = NDArray[Any]
POWERS: Final = (1, 2, 3)
"""Shapes p of the tails."""
DELAYS_RAD: Final = np.geomspace(0.025, 5.0, 32)
"""Their mean delays."""
WIDTHS_RAD: Final = (0.04, 0.09, 0.17)
"""Standard deviations of exponential tails that are widened."""
UNKNOWNS: Final = 4
"""Of a shape: phi, w, v and its delay."""
SPLIT: Final = 10.0
"""By how much a tail must lower chi-square before a single return is doubted: noise alone lowers
it by as much in fewer than one of a hundred pixels."""
_COARSE_RAD: Final = 2 * np.pi * np.arange(-1.1, 0.5, 0.02)
_FINE_RAD: Final = 2 * np.pi * np.arange(-0.024, 0.0245, 0.001)


@dataclass(frozen=True, eq=False)
class _Turned:
    """Moments (m, P) turned back to a phase that is near, and their weights.

    Attributes
    ----------
    weighted
        (m, P) moments times weights.
    weight
        (m, P) inverse variances of their parts.
    total
        (P) chi-square without any light.
    """

    weighted: _Array
    weight: _Array
    total: _Array

    def explained(self, phasors: _Array, q: _Array | None) -> _Array:
        """Return by how much light that begins at each phase (T, P) lowers chi-square.

        Parameters
        ----------
        phasors
            (m, T) of the phases.
        q
            (m) moments of the tail at phase 0; None for a sharp return alone.
        """
        conjugate = phasors.conj().T
        sharp = np.maximum((conjugate @ self.weighted).real, 0.0)
        ww = self.weight.sum(axis=0)
        if q is None:
            return np.asarray(sharp**2 / ww)
        late = np.maximum((conjugate @ (q.conj()[:, None] * self.weighted)).real, 0.0)
        wv = q.real @ self.weight
        vv = np.abs(q) ** 2 @ self.weight
        w = vv * sharp - wv * late
        v = ww * late - wv * sharp
        both = (w * sharp + v * late) / (ww * vv - wv**2)
        one = np.maximum(sharp**2 / ww, late**2 / vv)
        return np.where((w > 0) & (v > 0), both, one)

    def turned(self, phase: _Array) -> "_Turned":
        """Return the moments turned back further, by a phase (P) of the highest harmonic."""
        m = len(self.weighted)
        j = np.arange(1, m + 1)[:, None] / m
        return _Turned(self.weighted * np.exp(-1j * j * phase), self.weight, self.total)


def plausible_ranges(
    b: _Array,
    variance: _Array,
    base_frequency_hz: float,
    direct_m: _Array,
    uncertainty_m: _Array,
) -> tuple[_Array, _Array]:
    """Return the earliest and the latest range (P) that the direct light may have.

    A pixel whose moments a single return explains is taken for one.

    Parameters
    ----------
    b
        (m + 1, P) moments.
    variance
        (m + 1, P) of their parts.
    direct_m, uncertainty_m
        (P) the range of the direct return and by how much it may be longer; part of what is
        returned.
    """
    m = len(b) - 1
    earliest_m, latest_m = direct_m, direct_m + uncertainty_m
    free = 2 * m - UNKNOWNS
    if free < 1:  # any shape explains these
        return earliest_m, latest_m
    finest_hz = m * base_frequency_hz
    j = np.arange(1, m + 1) / m
    near = 4 * np.pi * finest_hz * direct_m / tm.SPEED_OF_LIGHT_M_S
    weight = 1.0 / variance[1:].astype(float)
    moments = b[1:].astype(complex)
    total = (weight * np.abs(moments) ** 2).sum(axis=0)
    pixels = _Turned(weight * moments, weight, total).turned(near)
    single, _ = _fitted(pixels, j, None)
    limit = chi_square_quantile(free, SIGNIFICANCE)
    least = single
    for q in _tails(j):
        chi_square, phase = _fitted(pixels, j, q)
        least = np.minimum(least, chi_square)
        begins_m = direct_m + tm.range_m(phase, finest_hz)
        possible = chi_square <= limit
        earliest_m = np.where(possible, np.minimum(earliest_m, begins_m), earliest_m)
        latest_m = np.where(possible, np.maximum(latest_m, begins_m), latest_m)
    plain = single <= least + SPLIT
    return (
        np.where(plain, direct_m, np.maximum(earliest_m, 0.0)),
        np.where(plain, direct_m + uncertainty_m, latest_m),
    )


def _tails(j: _Array) -> Iterator[_Array]:
    """Yield the moments (m) of tails that begin at phase 0, at harmonics over the highest."""
    for delay in DELAYS_RAD:
        for power in POWERS:
            yield (1 - 1j * j * delay / power) ** -power
        for width in WIDTHS_RAD:
            yield np.exp(-((j * width) ** 2) / 2) / (1 - 1j * j * delay)


def _fitted(pixels: _Turned, j: _Array, q: _Array | None) -> tuple[_Array, _Array]:
    """Return the least chi-square (P) of a shape, and at which phase (P) it begins."""
    coarse = pixels.explained(np.exp(1j * j[:, None] * _COARSE_RAD), q)
    phase = _COARSE_RAD[coarse.argmax(axis=0)]
    fine = pixels.turned(phase).explained(np.exp(1j * j[:, None] * _FINE_RAD), q)
    return pixels.total - fine.max(axis=0), phase + _FINE_RAD[fine.argmax(axis=0)]
