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
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_moments.likelihood import SIGNIFICANCE, chi_square_quantile

_Array = NDArray[Any]
POWERS: Final = (1, 2, 3)
"""Shapes p of the tails."""
DELAYS_RAD: Final = np.geomspace(0.025, 5.0, 64)
"""Their mean delays; between them chi-square is taken for a parabola."""
SEARCHED_EVERY: Final = 4
"""The phase of a shape is searched far and wide for one in so many delays; between them it moves by
little."""
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
class _RotatedMoments:
    """Moments (m, P) rotated back by a phase that is near, and their weights.

    ``weighted``: (m, P) moments times weights.
    ``weight``: (m, P) inverse variances of their parts.
    ``total``: (P) chi-square without any light.
    """

    weighted: _Array
    weight: _Array
    total: _Array

    def explained(self, phasors: _Array, q: _Array | None) -> _Array:
        """Return by how much light that begins at each phase (T, P) lowers chi-square.

        ``phasors``: (m, T) of the phases.
        ``q``: (m) moments of the tail at phase 0; None for a sharp return alone.
        """
        # by `einsum`: threads of BLAS would wait busily for each other
        turned = partial(np.einsum, "mt,mp->tp", phasors.conj())
        sharp = np.maximum(np.real(turned(self.weighted)), 0.0)
        ww = self.weight.sum(axis=0)
        if q is None:
            return np.asarray(sharp**2 / ww)
        late = np.maximum(np.real(turned(q.conj()[:, None] * self.weighted)), 0.0)
        wv = np.real(q) @ self.weight
        vv = np.abs(q) ** 2 @ self.weight
        w = vv * sharp - wv * late
        v = ww * late - wv * sharp
        both = (w * sharp + v * late) / (ww * vv - wv**2)
        one = np.maximum(sharp**2 / ww, late**2 / vv)
        return np.asarray(np.where((w > 0) & (v > 0), both, one))

    def rotated(self, phase: _Array) -> "_RotatedMoments":
        """Return the moments rotated back further, by a phase (P) of the highest harmonic."""
        m = len(self.weighted)
        j = np.arange(1, m + 1)[:, None] / m
        return _RotatedMoments(self.weighted * np.exp(-1j * j * phase), self.weight, self.total)


def plausible_ranges(
    b: _Array, variance: _Array, base_frequency_hz: float, direct_m: _Array, uncertainty_m: _Array
) -> tuple[_Array, _Array]:
    """Return the earliest and the latest range (P) that the direct light may have.

    A pixel whose moments a single return explains is taken for one.

    ``b``: (m + 1, P) moments.
    ``variance``: (m + 1, P) of their parts.
    ``direct_m``, ``uncertainty_m``: (P) the range of the direct return and by how much it may be
    longer; part of what is returned.
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
    pixels = _RotatedMoments(weight * moments, weight, total).rotated(near)
    single, _ = _fitted(pixels, j, None, None)
    limit = chi_square_quantile(free, SIGNIFICANCE)
    least = single
    for chi_square, phase in _families(pixels, j):
        least = np.minimum(least, chi_square.min(axis=0))
        begins_m = direct_m + tm.range_m(phase, finest_hz)
        possible = chi_square <= limit
        first_m = np.where(possible, begins_m, np.inf).min(axis=0)
        last_m = np.where(possible, begins_m, -np.inf).max(axis=0)
        earliest_m, latest_m = np.minimum(earliest_m, first_m), np.maximum(latest_m, last_m)
    plain = single <= least + SPLIT
    return (
        np.where(plain, direct_m, np.maximum(earliest_m, 0.0)),
        np.where(plain, direct_m + uncertainty_m, latest_m),
    )


def _families(pixels: _RotatedMoments, j: _Array) -> Iterator[tuple[_Array, _Array]]:
    """Yield the least chi-square (K, P) of tails of one form, and the phases at which they begin.

    ``j``: (m) harmonics over the highest.
    """
    widened = [(np.exp(-((j * width) ** 2) / 2), 1) for width in WIDTHS_RAD]
    for factor, power in [*((np.ones_like(j), each) for each in POWERS), *widened]:
        found: list[tuple[_Array, _Array]] = []
        for place, delay in enumerate(DELAYS_RAD):
            q = factor * (1 - 1j * j * delay / power) ** -power
            near = None if place % SEARCHED_EVERY == 0 else found[-1][1]
            found.append(_fitted(pixels, j, q, near))
        chi_square, phase = (np.array(each) for each in zip(*found, strict=True))
        yield _with_minima(chi_square, phase)


def _with_minima(chi_square: _Array, phase: _Array) -> tuple[_Array, _Array]:
    """Put the least values between those of three delays in the place of the middle one's."""
    before, here, after = chi_square[:-2], chi_square[1:-1], chi_square[2:]
    bend = before - 2 * here + after
    valley = (here <= before) & (here <= after) & (bend > 0)
    place = np.where(valley, (before - after) / (2 * np.where(valley, bend, 1.0)), 0.0)
    slope = (phase[2:] - phase[:-2]) / 2
    least = np.maximum(here - place * (before - after) / 4, 0.0)
    chi_square, phase = chi_square.copy(), phase.copy()
    chi_square[1:-1] = np.where(valley, least, here)
    phase[1:-1] += place * slope
    return chi_square, phase


def _fitted(
    pixels: _RotatedMoments, j: _Array, q: _Array | None, near: _Array | None
) -> tuple[_Array, _Array]:
    """Return the least chi-square (P) of a shape, and at which phase (P) it begins.

    ``near``: (P) a phase that is near; searched where it is None.
    """
    if near is None:
        coarse = pixels.explained(np.exp(1j * j[:, None] * _COARSE_RAD), q)
        near = _COARSE_RAD[coarse.argmax(axis=0)]
    fine = pixels.rotated(near).explained(np.exp(1j * j[:, None] * _FINE_RAD), q)
    return pixels.total - fine.max(axis=0), near + _FINE_RAD[fine.argmax(axis=0)]
