"""Two returns by a search over all pairs of phases, for frequencies with gaps.

`likelihood` looks for a second return in what the first one leaves. Where multiples are high and
few, that ends in the wrong pair: the first one alone explains most at a phase between the two, or
a period of the highest frequency beside. Here all pairs on a grid are tried together, and the best
of them polished.
"""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_compiled import Spread
from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import Array, by_blocks, in_range, moment_planes, namespace
from transientcam_moments.errors import ParameterError
from transientcam_moments.likelihood import _pair_fit as pair_fit
from transientcam_moments.likelihood._choice import COUNT, PLANES, SCORE, nothing
from transientcam_moments.likelihood._estimate import Likelihood, dense, prepared, results
from transientcam_moments.likelihood._planar import Data, SharpFit, where
from transientcam_moments.likelihood._sharp import SETTLED
from transientcam_moments.moment_problem import DIRECT_THRESHOLD
from transientcam_moments.noise import MomentNoise, free_of_scale

PHASES_PER_PERIOD: Final = 8
"""Of the grid, in a period of the highest frequency; docs/cameras.md has what is missed."""
PEAKS: Final = 3
"""Pairs that are kept of all those equally far apart."""
STARTS: Final = 16
"""Pairs of each pixel that are polished."""
LEAST_GAIN: Final = 0.7
"""What a pair on the grid has to explain of all light squared to be one of them; so has it more
than the best return alone."""
FIRST_STEPS: Final = 2
"""Of each start; `FINALISTS` of them take more."""
FINALISTS: Final = 4
LAST_STEPS: Final = 12
COINCIDE: Final = 0.999
"""Pairs whose moments are this alike, as a squared correlation, are one return."""
APART: Final = 0.25
"""Of a period of the highest frequency: direct returns so far apart are of different pairs."""
_LEAST_PHASES: Final = 24
_BLOCK: Final = 16  # pixels, whose pairs stay in cache


def grid(m: int) -> NDArray[np.floating[Any]]:
    """Return the phases of the grid in radians, an even number of them, for multiples up to m."""
    count = max(_LEAST_PHASES, PHASES_PER_PERIOD * m)
    return np.arange(count) * (2 * np.pi / count)


def least_alike(m: int) -> float:
    """Return the cosine of `APART`."""
    return float(np.cos(APART * 2 * np.pi / m))


def two_returns(
    b: Array,
    noise: MomentNoise | None = None,
    *,
    harmonics: Sequence[int] | None = None,
    model_error: float = 0.0,
    threshold: float = DIRECT_THRESHOLD,
    threads: int | None = None,
) -> Likelihood:
    """Estimate one or two returns of every pixel from moments at any frequencies.

    Parameters
    ----------
    b : array, shape (N, ...)
        Moments, calibrated, not biased.
    noise : MomentNoise, optional
        As of `likelihood`.
    harmonics : sequence of int, optional
        Which multiples of the base frequency they are, N different ones of 0 to 32 in any order;
        0 to N - 1 when left out. Two returns need two or more beside 0, and a test of them three.
    model_error, threshold : float
        As of `likelihood`.
    threads : int, optional
        How many the compiled kernel uses; all cores, when left out.

    Returns
    -------
    Likelihood
        With two slots and without tails. One return is in it where two lower
        chi^2 + n_unknowns (log n_numbers + 6) by too little: where noise explains what it leaves.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers, or noise or harmonics don't fit it.
    ParameterError
        For other harmonics or model errors, for less than one thread, and for arrays that JAX
        traces: two returns are found with NumPy, outside of `jax.jit` and `jax.grad`.

    Notes
    -----
    Weighted least squares of b_j = w_1 exp(i j phi_1) + w_2 exp(i j phi_2), w >= 0. The weights are
    eliminated at each pair of a grid of 6 phases a period of the highest frequency. Of the pairs
    that explain more than those beside them, the 16 best take two steps of Levenberg and Marquardt,
    and the best four of these more. Where one of them has another direct return, a quarter of
    a period of the highest frequency away or more, `lead` says how much worse it explains.
    In single precision a compiled kernel does the same; see `kernels`.
    """
    return fitted_pairs(b, noise, on_threads(threads), harmonics, model_error, threshold)


@free_of_scale
def fitted_pairs(
    b: Array,
    noise: MomentNoise,
    spread: Spread,
    harmonics: Sequence[int] | None = None,
    model_error: float = 0.0,
    threshold: float = DIRECT_THRESHOLD,
) -> Likelihood:
    """Do what `two_returns` does, with the threads of a caller."""
    planes, trailing = moment_planes(b)
    in_range("model_error", model_error, 0.0, 1.0, "0 to 1")
    xp = namespace(planes)
    try:
        filled = [np.asarray(part) for part in dense(planes, noise, harmonics, trailing)]
    except TypeError as error:  # JAX's, of an array that has no values yet
        limit = "an array with values: pairs are chosen by these, outside of jax.jit and jax.grad"
        raise ParameterError("b", type(planes).__name__, limit) from error
    found = _estimated(*filled, float(model_error), float(threshold), spread=spread)
    shaped = (xp.asarray(part).reshape((*part.shape[:-1], *trailing)) for part in found)
    return Likelihood._make([*shaped, float(threshold)])


@accelerated("pairs")
def _estimated(planes: Array, variance: Array, *options: float) -> tuple[Array, ...]:
    """Return the attributes of `Likelihood` of flat planes, but for `threshold`."""
    return by_blocks(lambda b, variance: _estimate(b, variance, *options), planes, variance)


def _estimate(b: Array, variance: Array, error: float, threshold: float) -> tuple[Array, ...]:
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        data, scale, usable = prepared(b, variance, error)
        found, lead = _fit(data, threshold)
        slots = min(2, b.shape[0] - 1)
        return *results(found, data, scale, usable, slots), lead.astype(scale.dtype)


def _fit(data: Data, threshold: float) -> tuple[list[Array], Array]:
    """Return what is found of every pixel, planes as `choice` lays them out, and its lead."""
    found = [data.re[0]] * PLANES
    far = np.inf + 0 * data.penalty
    nothing(data.penalty, far, found)
    one = SharpFit.start(data, 1, None, far)
    one.offer(found, data.numbers >= 0, threshold)

    def more(data: Data, before: tuple[Array, ...], planes: list[Array]) -> list[Array]:
        *found, _ = planes
        pair, lead = _best_pair(data)
        pair.offer(found, data.numbers >= 4, threshold)
        return [*found, np.where(found[COUNT] == 2, lead, np.inf)]

    # chi-square cannot become less than 0: no model with more unknowns is better below
    if len(data.re) > 2:
        *found, far = where(found[SCORE] > 4 * data.penalty, more, data, (), [*found, far])
    return found, far


class _Pairs:
    """Fits of two returns (S, P), several of each pixel, at the multiples that were measured."""

    def __init__(self, data: Any, phases: Sequence[Array]) -> None:
        self.places = _measured(data)
        self.weight = data.weight[self.places]
        share = self.weight / data.weight.sum(axis=0)
        self._given = (self.places, data.re[self.places], data.im[self.places])
        self._weighted = (*self._given, self.weight, share)
        self.x: list[Any] = [np.cos(each).astype(share.dtype) for each in phases]
        self.y: list[Any] = [np.sin(each).astype(share.dtype) for each in phases]
        self._begin()

    def _begin(self) -> None:
        self.w, self._pr, self._pi = [self.x[0]] * 2, *self._room()
        state = (self.x, self.y, self.w, self._pr, self._pi)
        self.cost = pair_fit.begin(*self._weighted, *state)

    def _room(self) -> tuple[list[Array], list[Array]]:
        size = 2 * len(self.places)
        return [self.x[0]] * size, [self.x[0]] * size

    def improve(self, steps: int) -> None:
        """Take at most so many steps to a lower chi-square."""
        state = (self.x, self.y, self.w, self._pr, self._pi)
        trial = [self.x[0]] * 2, [self.x[0]] * 2, [self.x[0]] * 2, *self._room()
        far = np.inf + 0 * self.cost
        damping = pair_fit.first_damping(far > 0, self.cost)
        for _ in range(steps):
            if not (damping < SETTLED).any():
                break
            self.cost, damping = pair_fit.step(
                *self._weighted, *state, *trial, self.cost, damping, far
            )

    def keep(self, count: int) -> None:
        """Keep the best ones of each pixel, the best one first."""
        best = np.argsort(self.cost, axis=0)[:count]
        self.x = [np.take_along_axis(each, best, axis=0) for each in self.x]
        self.y = [np.take_along_axis(each, best, axis=0) for each in self.y]
        self._begin()


def _best_pair(data: Data) -> tuple[SharpFit, Array]:
    """Return the best fit of two returns (P), and the lead over those with another range (P)."""
    re, im, weight = (np.stack(each) for each in data[:3])
    stacked: Any = data._replace(re=re, im=im, weight=weight)  # type: ignore[arg-type]  # arrays
    pairs = _Pairs(stacked, _starts(stacked))
    pairs.improve(FIRST_STEPS)
    pairs.keep(FINALISTS)
    pairs.improve(LAST_STEPS)
    pairs.improve(FIRST_STEPS)  # anew: the last step before may have been damped
    pairs.keep(FINALISTS)
    x, y = pair_fit.direct(pairs.x, pairs.y, pairs.w)
    other = x * x[0] + y * y[0] < least_alike(len(data.re) - 1)
    lead = np.where(other, pairs.cost, np.inf).min(axis=0) - pairs.cost[0]
    best = SharpFit(data, *([each[0] for each in part] for part in (pairs.x, pairs.y, pairs.w)))
    best.cost = pairs.cost[0]
    return best, lead


def _measured(data: Any) -> NDArray[np.intp]:
    """Return the multiples that were measured in any pixel."""
    return np.flatnonzero((data.weight > 0).any(axis=1))


def _starts(data: Any) -> tuple[NDArray[np.floating[Any]], NDArray[np.floating[Any]]]:
    """Return the phases (STARTS, P) of the most promising pairs, the earlier ones first."""
    phase = grid(len(data.re) - 1)
    count = len(phase)
    measured = _measured(data)
    angle = np.outer(phase, measured)
    cosine, sine = (part(angle).astype(data.re.dtype) for part in (np.cos, np.sin))
    share = data.weight[measured] / data.weight.sum(axis=0)
    # of each phase, the moments' projection on those of a return there
    along = cosine @ (share * data.re[measured]) + sine @ (share * data.im[measured])
    alike = cosine[1 : count // 2 + 1] @ share  # of two phases so many steps apart
    blocks = range(0, along.shape[1], _BLOCK)
    squared = (share * (data.re[measured] ** 2 + data.im[measured] ** 2)).sum(axis=0)
    least = np.maximum(LEAST_GAIN * squared, np.maximum(along, 0).max(axis=0) ** 2)
    planes = (along, alike, least[None])
    best = [_peaks(*(plane[:, at : at + _BLOCK] for plane in planes)) for at in blocks]
    apart, first = np.divmod(np.concatenate(best, axis=1), count)
    return phase[first], phase[(first + apart + 1) % count]


def _peaks(along: Array, alike: Array, least: Array) -> Array:
    """Return the places (STARTS, P) of the pairs that explain most, and more than those beside.

    A pair has the place steps apart - 1, then its first phase: (G // 2, G) in one row, of which
    the best `PEAKS` count. Where fewer pairs explain more than `least` (1, P), the last are
    opposite phases.
    """
    count = len(along)
    partner = (np.arange(count) + np.arange(1, count // 2 + 1)[:, None]) % count
    s = alike[:, None]
    both = np.broadcast_to(along, (count // 2, *along.shape)), along[partner]
    left = both[0] - s * both[1], both[1] - s * both[0]  # in the signs of the weights
    usable = (left[0] > 0) & (left[1] > 0) & (s * s < COINCIDE)
    gain = np.where(usable, (both[0] * left[0] + both[1] * left[1]) / (1 - s * s), 0)
    peak = (gain >= np.roll(gain, 1, axis=1)) & (gain >= np.roll(gain, -1, axis=1))
    peak[1:] &= gain[1:] >= gain[:-1]
    peak[:-1] &= gain[:-1] >= gain[1:]
    lost = np.where(peak & (gain > least), -gain, 0)
    row = np.argpartition(lost, PEAKS, axis=1)[:, :PEAKS]
    kept = np.take_along_axis(lost, row, axis=1).reshape((-1, along.shape[1]))
    place = (row + count * np.arange(count // 2)[:, None, None]).reshape(kept.shape)
    best = np.argpartition(kept, STARTS, axis=0)[:STARTS]
    opposite = (count // 2 - 1) * count
    there = np.take_along_axis(kept, best, axis=0) < 0
    return np.where(there, np.take_along_axis(place, best, axis=0), opposite)
