"""One return from the phases of several frequencies, and whether another range fits as well."""

import math
from collections.abc import Iterable, Sequence
from functools import reduce
from operator import add
from typing import Final, NamedTuple

import numpy as np

from transientcam_moments.arrays import (
    MAX_HARMONICS,
    MAX_MULTIPLE,
    Array,
    by_blocks,
    in_range,
    in_turn,
    moment_planes,
    namespace,
    summary,
)
from transientcam_moments.errors import ParameterError
from transientcam_moments.likelihood._chi_square import SIGNIFICANCE, ambiguous, explained, reduced
from transientcam_moments.likelihood._estimate import places_of, variance_of
from transientcam_moments.moment_problem import Separation
from transientcam_moments.noise import MomentNoise, free_of_scale

SAME_DEVIATIONS: Final = 4.0
"""Wrap counts whose phases are no further apart than so many deviations are one hypothesis."""
_TURN: Final = 2 * np.pi
_BEYOND: Final = 0.02
"""Of the largest phase, by which noise may leave the phases that are looked at."""


class Unwrapped(NamedTuple):
    """One return of every pixel, and how much worse the next best wrap counts explain its phases.

    Attributes
    ----------
    phase_rad : array, shape (...)
        Of the base frequency, in [0, 2 pi / g) with g the greatest common divisor of the
        multiples; NaN without light.
    phase_std_rad : array, shape (...)
        Its standard deviation, if the wrap counts are right.
    weight : array, shape (...)
        Light of the return, >= 0, in the unit of the moments; 0 without any.
    chi_square : array, shape (...)
        Sum of squares of what is left of the phases, over their variances.
    lead : array, shape (...)
        By how much chi-square is larger with the best wrap counts that give another phase;
        infinite where there are none.
    degrees_of_freedom : integer array, shape (...)
        How many more phases were measured than one; 0 without light.
    """

    phase_rad: Array
    phase_std_rad: Array
    weight: Array
    chi_square: Array
    lead: Array
    degrees_of_freedom: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)

    @property
    def reduced_chi_square(self) -> Array:
        """Chi-square of the phases over its degrees of freedom; NaN where there are none."""
        return reduced(self.chi_square, self.degrees_of_freedom)

    def ambiguous(self, significance: float = SIGNIFICANCE) -> Array:
        """Say where noise may have taken another hypothesis for the right one.

        Parameters
        ----------
        significance : float
            How likely, over the best one, another hypothesis may be, 0 < significance < 1.

        Returns
        -------
        boolean array, shape (...)
            Where exp(-lead / 2), the ratio of the likelihoods, is larger.

        Raises
        ------
        ParameterError
            For a significance outside of 0 to 1.
        """
        return ambiguous(self.lead, significance)

    def explained(self, significance: float = SIGNIFICANCE) -> Array:
        """Say where one return explains the phases; arguments as of `Likelihood.explained`."""
        return explained(self.chi_square, self.degrees_of_freedom, significance)

    def separate(self) -> Separation:
        """Return all light as direct."""
        return Separation(self.weight, 0 * self.weight, self.phase_rad)


def unwrap(
    b: Array,
    noise: MomentNoise | None = None,
    *,
    harmonics: Sequence[int] | None = None,
    model_error: float = 0.0,
    most_rad: float | None = None,
) -> Unwrapped:
    """Estimate one return of every pixel from the phases of its moments.

    Parameters
    ----------
    b : array, shape (N, ...)
        Moments, calibrated, not biased.
    noise : MomentNoise, optional
        As of `likelihood`.
    harmonics : sequence of int, optional
        Which multiples of the base frequency they are, N different ones of 0 to 32, or with
        `most_rad` to 65536, in any order; 0 to N - 1 when left out. That of 0 has no phase and may
        be anything.
    model_error : float
        As of `likelihood`.
    most_rad : float, optional
        The largest phase of the base frequency that is looked for; a turn, when left out.

    Returns
    -------
    Unwrapped
        Pixels without light or with a measured moment that is not finite have no return,
        nor have those that none within `most_rad` is found of.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers, or noise or harmonics don't fit it.
    ParameterError
        For other harmonics, model errors or `most_rad`, and for 0 alone.

    Notes
    -----
    Noise smaller than the rounding of the moments' precision counts as that large.

    Minimises sum_j (arg b_j + 2 pi n_j - j phi)^2 / s_j^2 over phi and whole n_j, with
    s_j = std(b_j) / |b_j|; compare Droeschel, Holz and Behnke 2010 (Multi-frequency phase
    unwrapping for time-of-flight cameras), who do so for two frequencies. As phi goes around, the
    nearest n_j of each frequency change at j / g places. Between two such places all n_j are
    constant, so that these intervals, as many as the sum of all j / g, are all wrap counts that
    can be the best.
    """
    return _unwrapped(b, noise, harmonics, model_error, most_rad)


@free_of_scale
def _unwrapped(
    b: Array,
    noise: MomentNoise,
    harmonics: Sequence[int] | None,
    model_error: float,
    most_rad: float | None,
) -> Unwrapped:
    planes, trailing = moment_planes(b)
    in_range("model_error", model_error, 0.0, 1.0, "0 to 1")
    if most_rad is not None:
        in_range("most_rad", most_rad, 0.0, float(_TURN), "0 to a turn")
    places = places_of(
        harmonics, planes.shape[0], MAX_HARMONICS if most_rad is None else MAX_MULTIPLE
    )
    variance = variance_of(noise, planes, trailing)
    kept = [at for at, j in enumerate(places) if j > 0]
    if not kept:
        raise ParameterError("harmonics", places, "one beside 0")
    xp = namespace(planes)
    multiples = [places[at] for at in kept]
    found = by_blocks(
        lambda b, variance: _unwrap(b, variance, multiples, float(model_error), most_rad),
        xp.stack([planes[at] for at in kept]),
        xp.stack([variance[at] for at in kept]),
    )
    return Unwrapped(*(part.reshape(trailing) for part in found))


def _unwrap(
    b: Array, variance: Array, multiples: list[int], error: float, most_rad: float | None
) -> tuple[Array, ...]:
    """Return the attributes of `Unwrapped` of planes (N, P)."""
    xp = namespace(b)
    divisor = math.gcd(*multiples)
    coprime = [j // divisor for j in multiples]
    with np.errstate(all="ignore"):  # pixels that cannot be used are computed along
        seen = (variance > 0) & (variance < np.inf)
        size = xp.where(seen, abs(b), 0)
        largest = size.max(axis=0)
        usable = xp.isfinite(largest) & (largest > 0)
        # over the largest moment: the squares of what is small neither vanish nor overflow
        noise = xp.maximum(xp.sqrt(variance) / largest, 4 * float(np.finfo(size.dtype).eps))
        inverse = xp.where(seen & usable, 1 / (noise**2 + error**2), 0)
        precision = xp.where(usable, inverse * (size / largest) ** 2, 0)
        angle = xp.where(seen & usable, xp.arctan2(b.imag, b.real), 0)
        std = 1 / xp.sqrt(_sum(j * j * each for j, each in zip(coprime, precision, strict=True)))
        most = None if most_rad is None or most_rad * divisor >= _TURN else most_rad * divisor
        same = SAME_DEVIATIONS * std
        best, phase, second = _search(list(angle), list(precision), coprime, same, most)
        usable = usable & xp.isfinite(best)
        turned = _sum(
            weight * (plane.real * xp.cos(j * phase) + plane.imag * xp.sin(j * phase))
            for j, weight, plane in zip(coprime, inverse, b, strict=True)
        )
        light = xp.where(usable, turned / _sum(inverse), 0)
        free = xp.where(usable, seen.sum(axis=0) - 1, 0)
        real = size.dtype
        return (
            (xp.where(usable, in_turn(phase), np.nan) / divisor).astype(real),
            (xp.where(usable, std, np.nan) / divisor).astype(real),
            xp.maximum(light, 0).astype(real),
            xp.where(usable, best, np.nan).astype(real),
            xp.where(usable, second - best, np.nan).astype(real),
            free.astype(np.int32),
        )


def _search(
    angle: list[Array],
    precision: list[Array],
    multiples: list[int],
    same: Array,
    most_rad: float | None,
) -> tuple[Array, Array, Array]:
    """Return the least chi-square, its phase, and the least one more than `same` away from it."""
    xp = namespace(same)
    information = _sum(j * j * each for j, each in zip(multiples, precision, strict=True))
    best, phase, second = np.inf + 0 * angle[0], 0 * angle[0], np.inf + 0 * angle[0]
    for k, j in enumerate(multiples):
        first, last = (0, j) if most_rad is None else (-1, int(j * most_rad / _TURN) + 1)
        for turns in range(first, last):
            # where the count of frequency k becomes one more, and all others are the nearest
            edge = (angle[k] + (2 * turns + 1) * np.pi) / j
            unwrapped = [
                each + _TURN * (turns + 1 if i == k else xp.round((of * edge - each) / _TURN))
                for i, (of, each) in enumerate(zip(multiples, angle, strict=True))
            ]
            planes = list(zip(multiples, precision, unwrapped, strict=True))
            tried = _sum(of * weight * plane for of, weight, plane in planes) / information
            cost = _sum(weight * (plane - of * tried) ** 2 for of, weight, plane in planes)
            known = precision[k] > 0
            if most_rad is not None:
                known &= abs(tried / most_rad - 0.5) < 0.5 + _BEYOND
            cost = xp.where(known, cost, np.inf)
            apart = abs(xp.remainder(tried - phase + np.pi, _TURN) - np.pi) > same
            better = cost < best
            loser = xp.where(better, best, cost)
            second = xp.where(apart & (loser < second), loser, second)
            best, phase = xp.where(better, cost, best), xp.where(better, tried, phase)
    return best, xp.remainder(phase, _TURN), second


def _sum(planes: Iterable[Array]) -> Array:
    return reduce(add, planes)
