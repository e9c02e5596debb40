"""First-order noise of Pisarenko's returns, and of what is derived from them."""

import math
from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import lookup
from transientcam_moments.arrays import Array, in_range, namespace, summary
from transientcam_moments.moment_problem import DIRECT_THRESHOLD, Returns
from transientcam_moments.noise import _first_order as first_order
from transientcam_moments.noise._cramer_rao import COINCIDE_RAD, CramerRao, cramer_rao
from transientcam_moments.noise._moments import MomentNoise

CLEAR = 8.0
"""Standard deviations that returns must keep from vanishing, from each other, from the ends of the
turn and from the threshold for first order to hold."""

_ROUNDING = 1024.0
"""Of sums of terms that cancel each other, in eps: they are known to a thousandth."""


class ReturnNoise(NamedTuple):
    """Standard deviations of returns; shapes as of `Returns` and `Separation`.

    Attributes
    ----------
    phase_std_rad, weight_std : array, shape (m, ...)
        Of every return; NaN in unused slots.
    uniform_std : array, shape (...)
        Of the uniform part.
    direct_phase_std_rad, direct_std, indirect_std : array, shape (...)
        Of the direct return's phase and weight and of all other weights together; NaN where there
        is no return.
    holds : boolean array, shape (...)
        Where first order holds.
    """

    phase_std_rad: Array
    weight_std: Array
    uniform_std: Array
    direct_phase_std_rad: Array
    direct_std: Array
    indirect_std: Array
    holds: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def return_noise(
    returns: Returns, noise: MomentNoise, *, threshold: float = DIRECT_THRESHOLD
) -> ReturnNoise:
    """Propagate the noise of moments to the returns that Pisarenko's estimate finds in them.

    Parameters
    ----------
    returns : Returns
        From `pisarenko`, of moments without noise if those are known, else of the measured ones.
    noise : MomentNoise
        Of shape (m + 1, ...).
    threshold : float
        As for `separate`, 0 to 1.

    Returns
    -------
    ReturnNoise

    Raises
    ------
    ParameterError
        For a threshold outside of 0 to 1.

    Notes
    -----
    Implicit differentiation of b_j = sum_k w_k exp(i j phi_k), j = 1 .. m. With m returns these
    are as many real equations as unknowns: the inverse of their Jacobian is all there is, and the
    estimate reaches the Cramer-Rao bound. b_0, however it was measured or biased, is in none of
    them; it only moves the uniform part.

    First order fails, and `holds` is false, with fewer than m returns (the rest of the estimate is
    made of noise, splits the true returns and gives their phases heavy tails, so that what is
    stated is no more than the bound), where a return is no more than `CLEAR` standard deviations
    strong, where two are no further apart, and where the direct return might be another one.
    """
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    bound = cramer_rao(returns.phase_rad, returns.weight, noise)
    xp = namespace(bound.weight_std)
    used = returns.weight > 0
    first = _first(returns, used, threshold)
    any_there = used.any(axis=0)
    with np.errstate(all="ignore"):
        direct_phase_std, holds = _direct(returns, bound, threshold)
        total = _of_sum(bound, used)
        indirect = _of_sum(bound, used & ~first)
        return ReturnNoise(
            phase_std_rad=bound.phase_std_rad,
            weight_std=bound.weight_std,
            uniform_std=xp.sqrt(noise.variance[0] + total),
            direct_phase_std_rad=direct_phase_std,
            direct_std=xp.where(
                any_there, xp.where(first, bound.weight_std, 0).sum(axis=0), np.nan
            ),
            indirect_std=xp.where(any_there, xp.sqrt(indirect), np.nan),
            holds=holds,
        )


def direct_phase_noise(
    returns: Returns, noise: MomentNoise, *, threshold: float = DIRECT_THRESHOLD
) -> tuple[Array, Array]:
    """Return `direct_phase_std_rad` and `holds` of `return_noise` alone, in less time."""
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    count, pixels = returns.phase_rad.shape[0], returns.phase_rad.shape[1:]
    kernel = None
    if isinstance(returns.phase_rad, np.ndarray) and count == noise.variance.shape[0] - 1:
        kernel = lookup("direct_noise", count, math.prod(pixels), "d")
    if kernel is None:
        return _planar_direct_phase_noise(returns, noise, threshold)
    phase, weight, variance = (
        np.asarray(planes, float).reshape((count, -1))
        for planes in (returns.phase_rad, returns.weight, noise.variance[1:])
    )
    std_rad, holds, whole = kernel(phase, weight, variance, threshold, CLEAR, COINCIDE_RAD)
    if not whole.all():
        others = ~whole
        some = Returns(
            phase[:, others],
            weight[:, others],
            np.asarray(returns.uniform).reshape(-1)[others],
            np.asarray(returns.count).reshape(-1)[others],
        )
        of_some = MomentNoise(noise.variance.reshape((count + 1, -1))[:, others])
        std_rad[others], holds[others] = _planar_direct_phase_noise(some, of_some, threshold)
    return std_rad.reshape(pixels), holds.reshape(pixels)


def _planar_direct_phase_noise(
    returns: Returns, noise: MomentNoise, threshold: float
) -> tuple[Array, Array]:
    bound = cramer_rao(returns.phase_rad, returns.weight, noise)
    with np.errstate(all="ignore"):
        return _direct(returns, bound, threshold)


def _direct(returns: Returns, bound: CramerRao, threshold: float) -> tuple[Array, Array]:
    """Return the deviation of the direct return's phase, and where first order holds."""
    count = len(returns.weight)
    mixed = [bound.covariance[count + k, count + max(k - 1, 0)] for k in range(count)]
    found: tuple[Array, Array] = first_order.direct_noise(
        (0,) * count,
        threshold,
        CLEAR,
        list(returns.phase_rad),
        list(returns.weight),
        list(bound.phase_std_rad),
        list(bound.weight_std),
        mixed,
    )
    return found


def _first(returns: Returns, used: Array, threshold: float) -> Array:
    """Where the direct return is: the first one over the threshold."""
    direct = used & (returns.weight >= threshold * returns.weight.max(axis=0))
    return direct & (namespace(used).cumsum(direct, axis=0) == 1)


def _of_sum(bound: CramerRao, chosen: Array) -> Array:
    """Variance of the sum of the chosen weights; at least what rounding leaves of its terms."""
    xp = namespace(bound.covariance)
    count = chosen.shape[0]
    both = chosen[:, None] & chosen[None]
    terms = xp.where(both, bound.covariance[:count, :count], 0)
    least = _ROUNDING * float(np.finfo(terms.dtype).eps) * abs(terms).sum(axis=(0, 1))
    return xp.maximum(terms.sum(axis=(0, 1)), least)
