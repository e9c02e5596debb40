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

from transientcam_moments._arrays import Array, by_blocks, in_range, moment_planes, namespace
from transientcam_moments._kernels import accelerated
from transientcam_moments._kernels.parallel import Spread, on_threads
from transientcam_moments.likelihood.choice import PLANES, SCORE, nothing
from transientcam_moments.likelihood.estimate import Likelihood, dense, prepared, results
from transientcam_moments.likelihood.planar import Data, SharpFit, where
from transientcam_moments.noise.moments import MomentNoise

PHASES_PER_PERIOD: Final = 8
"""Of the grid, in a period of the highest frequency. With 4, one pair in 25 that is 3 to 8 m apart
at 16, 80 and 120 MHz is not among the starts; docs/cameras.md has what is left."""
STARTS: Final = 16
"""Pairs of each pixel that are polished."""
FIRST_STEPS: Final = 6
"""Of each start; the best one alone takes more."""
LAST_STEPS: Final = 16
COINCIDE: Final = 0.999
"""Pairs whose moments are this alike, as a squared correlation, are one return."""
_LEAST_PHASES: Final = 24
_BLOCK: Final = 16  # pixels, whose pairs stay in cache


def grid(m: int) -> NDArray[np.floating[Any]]:
    """Return the phases of the grid in radians, an even number of them, for multiples up to m."""
    count = max(_LEAST_PHASES, PHASES_PER_PERIOD * m)
    return np.arange(count) * (2 * np.pi / count)


def two_returns(
    b: Array,
    noise: MomentNoise | None = None,
    *,
    harmonics: Sequence[int] | None = None,
    model_error: float = 0.0,
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
    model_error : float
        As of `likelihood`.
    threads : int, optional
        How many the compiled lane uses; all cores, when left out.

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
        For other harmonics or model errors, and for less than one thread.

    Notes
    -----
    Weighted least squares of b_j = w_1 exp(i j phi_1) + w_2 exp(i j phi_2), w >= 0. The weights are
    eliminated at each pair of a grid of 8 phases a period of the highest frequency; the 16 pairs
    that explain most, and more than those beside them, are polished by the steps of `likelihood`.
    In single precision a compiled lane does the same; see `kernels`.
    """
    return fitted_pairs(b, noise, on_threads(threads), harmonics, model_error)


def fitted_pairs(
    b: Array,
    noise: MomentNoise | None,
    spread: Spread,
    harmonics: Sequence[int] | None = None,
    model_error: float = 0.0,
) -> Likelihood:
    """Do what `two_returns` does, with the threads of a caller."""
    planes, trailing = moment_planes(b)
    in_range("model_error", model_error, 0.0, 1.0, "0 to 1")
    xp = namespace(planes)
    filled = (np.asarray(part) for part in dense(planes, noise, harmonics, trailing))
    found = _estimated(*filled, float(model_error), spread=spread)
    shaped = (xp.asarray(part).reshape((*part.shape[:-1], *trailing)) for part in found)
    return Likelihood._make([*shaped, 0])


@accelerated("pairs")
def _estimated(planes: Array, variance: Array, error: float) -> tuple[Array, ...]:
    """Return the attributes of `Likelihood` of flat planes."""
    return by_blocks(lambda b, variance: _estimate(b, variance, error), planes, variance)


def _estimate(b: Array, variance: Array, error: float) -> tuple[Array, ...]:
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        data, scale, usable = prepared(b, variance, error)
        return results(_fit(data), data, scale, usable, min(2, b.shape[0] - 1), 0)


def _fit(data: Data) -> Array:
    """Return what is found of every pixel (PLANES, P), as `choice` lays it out."""
    found = [data.re[0]] * PLANES
    far = np.inf + 0 * data.penalty
    nothing(data.penalty, far, found)
    one = SharpFit.start(data, 1, None, far)
    one.offer(found, data.numbers >= 0)
    planes = np.stack(found)

    def more(data: Data, before: tuple[Array, ...], planes: Array) -> Array:
        found = list(planes)
        _best_pair(data).offer(found, data.numbers >= 4)
        return np.stack(found)

    if len(data.re) < 3:
        return planes
    # chi-square cannot become less than 0: no model with more unknowns is better below
    return where(planes[SCORE] > 4 * data.penalty, more, data, (), planes)


def _best_pair(data: Data) -> SharpFit:
    """Return the best fit of two returns (P)."""
    far = np.inf + 0 * data.penalty
    first, second = _starts(data)
    best: SharpFit | None = None
    for start in zip(first, second, strict=True):
        x = [np.cos(each).astype(data.re.dtype) for each in start]
        y = [np.sin(each).astype(data.re.dtype) for each in start]
        fit = SharpFit.at(data, x, y)
        fit.improve(FIRST_STEPS, far)
        if best is None:
            best = fit
            continue
        better = fit.cost < best.cost
        x = [np.where(better, *both) for both in zip(fit.x, best.x, strict=True)]
        y = [np.where(better, *both) for both in zip(fit.y, best.y, strict=True)]
        best = SharpFit.at(data, x, y)
    assert best is not None  # noqa: S101 - there are STARTS of them
    best.improve(LAST_STEPS, far)
    return best


def _starts(data: Data) -> tuple[NDArray[np.floating[Any]], NDArray[np.floating[Any]]]:
    """Return the phases (STARTS, P) of the most promising pairs, the earlier ones first."""
    phase = grid(len(data.re) - 1)
    count = len(phase)
    measured = np.flatnonzero((data.weight > 0).any(axis=1))
    angle = np.outer(phase, measured)
    cosine, sine = (part(angle).astype(data.re.dtype) for part in (np.cos, np.sin))
    share = data.weight[measured] / data.weight.sum(axis=0)
    # of each phase, the moments' projection on those of a return there
    along = cosine @ (share * data.re[measured]) + sine @ (share * data.im[measured])
    alike = cosine[1 : count // 2 + 1] @ share  # of two phases so many steps apart
    blocks = range(0, along.shape[1], _BLOCK)
    best = [_peaks(along[:, at : at + _BLOCK], alike[:, at : at + _BLOCK]) for at in blocks]
    apart, first = np.divmod(np.concatenate(best, axis=1), count)
    return phase[first], phase[(first + apart + 1) % count]


def _peaks(along: Array, alike: Array) -> Array:
    """Return the places (STARTS, P) of the pairs that explain most, and more than those beside.

    A pair has the place steps apart - 1, then its first phase: (G // 2, G) in one row. Where there
    are fewer of them the last are opposite phases.
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
    flat = np.where(peak, -gain, 0).reshape((-1, along.shape[1]))
    best = np.argpartition(flat, STARTS, axis=0)[:STARTS]
    opposite = (count // 2 - 1) * count
    return np.where(np.take_along_axis(flat, best, axis=0) < 0, best, opposite)
