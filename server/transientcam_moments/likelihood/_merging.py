"""Returns that noise split in two, taken for one again."""

import numpy as np

from transientcam_moments.arrays import Array, as_array, in_turn, namespace, squared
from transientcam_moments.errors import ShapeError
from transientcam_moments.likelihood._chi_square import SIGNIFICANCE, chi_square_quantile
from transientcam_moments.moment_problem import Returns
from transientcam_moments.noise import ASSUMED_NOISE, MomentNoise


def merge_returns(returns: Returns, noise: MomentNoise | None = None) -> Returns:
    """Merge neighbouring returns wherever one return explains the moments as well, but for noise.

    Parameters
    ----------
    returns : Returns
        From `pisarenko`, of shape (m, ...).
    noise : MomentNoise, optional
        Of the moments, (m + 1, ...) or (m + 1,). Moments with a variance that is 0, infinite or NaN
        count as not measured; where no b_j was, nothing is merged. When left out, `ASSUMED_NOISE`
        times the light of the pixel.

    Returns
    -------
    result : `Returns`
        Of the same shape. What light a return has less than the two that it stands for is uniform.

    Raises
    ------
    ShapeError
        When the noise is of another shape.

    Notes
    -----
    `pisarenko` explains moments exactly, noise included, and so splits a return into several that
    are closer to each other than their deviation. Here the two neighbours around the turn whose
    merging changes the moments least become one in the direction of their sum, and so on, as long
    as each change is no larger than what noise exceeds in one pixel of a thousand: the quantile of
    chi-square with 2 m degrees of freedom.
    """
    xp = namespace(returns.weight)
    slots, trailing = returns.weight.shape[0], tuple(returns.weight.shape[1:])
    real = returns.weight.dtype
    phase, weight = (part.reshape((slots, -1)) for part in returns[:2])
    count, before = returns.count.reshape(-1), weight.sum(axis=0)
    # in parts of the light, whose squares neither vanish nor overflow
    light = before + xp.maximum(returns.uniform.reshape(-1), 0)
    light = xp.where(light > 0, light, 1)
    if noise is None:
        variance = xp.full((slots, 1), ASSUMED_NOISE**2)
    else:
        variance = as_array(noise.variance)
        if tuple(variance.shape) not in ((slots + 1,), (slots + 1, *trailing)):
            expected = f"({slots + 1},) or {(slots + 1, *trailing)}"
            raise ShapeError("noise", f"of shape {tuple(variance.shape)}", expected)
        variance = variance.reshape((slots + 1, -1))[1:] / light / light
    known = (variance > 0) & (variance < np.inf)
    precision = xp.where(known, 1 / xp.where(known, variance, 1), 0).astype(real)
    weight = weight / light
    limit = chi_square_quantile(2 * slots, SIGNIFICANCE)
    for _ in range(slots - 1):
        phase, weight, count = _merge_once(phase, weight, count, precision, limit)
    weight = weight * light
    lost = before - weight.sum(axis=0)
    return Returns(
        phase.reshape((slots, *trailing)).astype(real),
        weight.reshape((slots, *trailing)).astype(real),
        returns.uniform + lost.reshape(trailing).astype(real),
        count.reshape(trailing),
    )


def _merge_once(
    phase: Array, weight: Array, count: Array, precision: Array, limit: float
) -> tuple[Array, Array, Array]:
    """Merge the best pair of each pixel where that changes the moments by no more than `limit`."""
    xp = namespace(weight)
    slots = weight.shape[0]
    slot = xp.arange(slots)[:, None]
    after = xp.where(slot + 1 < count, slot + 1, 0)
    one = xp.exp(1j * xp.where(weight > 0, phase, 0))
    other, light = (xp.take_along_axis(part, after, axis=0) for part in (one, weight))
    mean = weight * one + light * other
    size = abs(mean)
    mean = xp.where(size > 0, mean / xp.where(size > 0, size, 1), 1)
    # of the light that explains the moments 1 to m best, by weighted least squares
    all_of, shared, sum_of = 0 * weight, 0 * weight, 0 * weight
    first, second, both = one, other, mean
    for j in range(slots):
        pair = weight * first + light * second
        all_of = all_of + squared(pair) * precision[j]
        shared = shared + (pair * both.conj()).real * precision[j]
        sum_of = sum_of + precision[j]
        first, second, both = first * one, second * other, both * mean
    total = xp.where(sum_of > 0, shared / xp.where(sum_of > 0, sum_of, 1), weight + light)
    misfit = all_of - total * shared
    misfit = xp.where((slot < count) & (count > 1), misfit, np.inf)
    best = xp.argmin(misfit, axis=0)[None]
    fits = (xp.take_along_axis(misfit, best, axis=0) <= limit)[0] & (precision > 0).any(axis=0)
    here = fits & (slot == best)
    gone = fits & (slot == xp.take_along_axis(after, best, axis=0))
    merged = in_turn(xp.arctan2(mean.imag, mean.real))
    phase = xp.where(gone, np.nan, xp.where(here, merged, phase))
    weight = xp.where(gone, 0, xp.where(here, total, weight))
    order = xp.argsort(phase, axis=0)  # NaN comes last
    phase, weight = (xp.take_along_axis(part, order, axis=0) for part in (phase, weight))
    return phase, weight, count - fits.astype(count.dtype)
