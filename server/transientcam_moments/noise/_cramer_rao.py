"""The Cramer-Rao bound of sparse returns: no unbiased estimate varies less."""

from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import Array, as_array, by_blocks, namespace, square_bank, summary
from transientcam_moments.errors import ShapeError
from transientcam_moments.noise import _interpolation as interpolation
from transientcam_moments.noise._moments import MomentNoise

COINCIDE_RAD = 1e-5
"""Returns closer than that cannot be resolved in double precision: the bound is infinite."""

_BLOCK_PIXELS = 4096


class CramerRao(NamedTuple):
    """Least covariance of phases and weights of K returns beside an unknown uniform part.

    Attributes
    ----------
    phase_std_rad : array, shape (K, ...)
        Standard deviation of each phase; NaN in unused slots, infinite where returns coincide.
    weight_std : array, shape (K, ...)
        Of each weight, in the unit of the weights.
    covariance : array, shape (2K, 2K, ...)
        Of the K weights, then of the K phases times their weights.
    """

    phase_std_rad: Array
    weight_std: Array
    covariance: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def cramer_rao(phase_rad: Array, weight: Array, noise: MomentNoise) -> CramerRao:
    """Return the Cramer-Rao bound of returns.

    Parameters
    ----------
    phase_rad, weight : array, shape (K, ...), K <= m
        True returns; slots with weight 0 or a phase of NaN are unused.
    noise : MomentNoise
        Of shape (m + 1, ...).

    Returns
    -------
    CramerRao
        In double precision.

    Raises
    ------
    ShapeError
        When there are more returns than harmonics, or the shapes don't fit.

    Notes
    -----
    b_j = sum_k w_k exp(i j phi_k) for j >= 1 depends on each return by exp(i j phi_k) per dw_k and
    i j exp(i j phi_k) per w_k dphi_k. b_0 has no information on returns as long as the uniform part
    is unknown, and that the variance itself depends on the brightness is left out. For one return:
    variance / (w^2 sum_j j^2), with the phase and the weight uncorrelated.
    """
    phase, weight = as_array(phase_rad), as_array(weight)
    count, m = phase.shape[0], noise.variance.shape[0] - 1
    if not 1 <= count <= m or phase.shape != weight.shape:
        raise ShapeError("phase_rad", f"of shape {tuple(phase.shape)}", f"1 to {m} returns")
    xp = namespace(phase)
    pixels = phase.shape[1:]
    phase = xp.asarray(phase, dtype=float).reshape((count, -1))
    weight = xp.asarray(weight, dtype=float).reshape((count, -1))
    variance = xp.asarray(noise.variance, dtype=float).reshape((m + 1, -1))[1:]
    used = (weight > 0) & xp.isfinite(phase)
    clear = _apart(xp.where(used, phase, np.nan)) > COINCIDE_RAD
    usable = used & clear
    with np.errstate(all="ignore"):
        covariance = _covariance(xp.where(usable, phase, 0), usable, variance)
        each = xp.sqrt(covariance.reshape((4 * count * count, -1))[:: 2 * count + 1])
        lost = xp.where(used, np.inf, np.nan)
        weight_std = xp.where(usable, each[:count], lost)
        phase_std = xp.where(usable, each[count:] / xp.where(usable, weight, 1), lost)
    return CramerRao(
        phase_std.reshape((count, *pixels)),
        weight_std.reshape((count, *pixels)),
        covariance.reshape((2 * count, 2 * count, *pixels)),
    )


def _covariance(phase: Array, used: Array, variance: Array) -> Array:
    """Return the covariance (2K, 2K, P), in closed form where there are as many returns as b_j."""
    xp = namespace(phase)
    if len(phase) < len(variance) or xp is not np:
        return xp.moveaxis(xp.linalg.inv(_information(phase, used, variance)), 0, -1)
    determined = used.all(axis=0)
    if determined.all():
        return _determined_covariance(phase, variance)
    covariance = np.empty((2 * len(phase), 2 * len(phase), phase.shape[1]))
    covariance[..., determined] = _determined_covariance(
        phase[:, determined], variance[:, determined]
    )
    others = phase[:, ~determined], used[:, ~determined], variance[:, ~determined]
    covariance[..., ~determined] = np.moveaxis(np.linalg.inv(_information(*others)), 0, -1)
    return covariance


@accelerated("covariance", order=lambda phase, _: len(phase))
def _determined_covariance(phase: Array, variance: Array) -> Array:
    """Return the covariance (2m, 2m, P) of m returns that m harmonics determine, in closed form."""
    return by_blocks(_interpolated, phase, variance, pixels=_BLOCK_PIXELS)[0]


def _interpolated(phase: Array, variance: Array) -> tuple[Array]:
    order, both = (0,) * len(phase), (0,) * (2 * len(phase))
    turned, out = interpolation.half_turned(phase), square_bank(phase[0], both, 0)
    x, y = list(turned[: len(phase)]), list(turned[len(phase) :])
    table, one = interpolation.basis(len(order)), np.ones_like(phase[0])
    interpolation.covariance(order, both, table, one, x, y, list(variance), out)
    rows = range(len(both))
    whole = [out[len(both) * max(i, j) + min(i, j)] for i in rows for j in rows]
    return (np.stack(whole).reshape((len(both), len(both), -1)),)


def _information(phase: Array, used: Array, variance: Array) -> Array:
    """Return Fisher's information (P, 2K, 2K); unused unknowns are tied to themselves."""
    xp = namespace(phase)
    m, count = variance.shape[0], phase.shape[0]
    j = xp.arange(1, m + 1).reshape((m, 1, 1))
    turn = xp.exp(1j * j * phase) * xp.where(used, 1, 0)
    derivative = xp.concatenate([turn, 1j * j * turn], axis=1) / xp.sqrt(variance)[:, None]
    stacked = xp.concatenate([derivative.real, derivative.imag])  # (2m, 2K, P)
    stacked = xp.moveaxis(stacked, -1, 0)
    information = xp.swapaxes(stacked, 1, 2) @ stacked
    idle = xp.where(xp.concatenate([used, used]), 0.0, 1.0).T
    return information + idle[:, :, None] * xp.eye(2 * count)


def _apart(phase: Array) -> Array:
    """Return each return's distance to the nearest other one, infinite without any."""
    xp = namespace(phase)
    apart = abs(phase[:, None] - phase[None])
    apart = xp.minimum(apart, 2 * np.pi - apart)
    own = xp.eye(phase.shape[0], dtype=bool)[:, :, None]
    return xp.where(own | xp.isnan(apart), np.inf, apart).min(axis=1)
