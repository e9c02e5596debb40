"""Covariance of as many returns as there are harmonics, by trigonometric interpolation."""

import numpy as np

from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import Array, by_blocks

_BLOCK_PIXELS = 1024


@accelerated("covariance", order=lambda phase, _: len(phase))
def determined_covariance(phase: Array, variance: Array) -> Array:
    """Return the covariance of m returns that m harmonics determine.

    Parameters
    ----------
    phase : array, shape (m, P), float64
        In radian, no two of a pixel alike.
    variance : array, shape (m, P), float64
        Of the real part of b_1 .. b_m, and of the imaginary part.

    Returns
    -------
    array, shape (2m, 2m, P), float64
        Of the m weights, then of the m phases times their weights.

    Notes
    -----
    db_j = sum_k (dw_k + i j w_k dphi_k) exp(i j phi_k). With p(phi) = Re sum_j conj(c_j) exp(i j
    phi) it follows that Re sum_j conj(c_j) db_j = sum_k p(phi_k) dw_k + p'(phi_k) w_k dphi_k: the
    polynomial that is 1 at phi_k, 0 at the other phases and without slope at all of them gives
    dw_k, and the one that is 0 at all of them with a slope of 1 at phi_k alone gives w_k dphi_k.
    Neither has a constant term, as there is none for b_0. Both exist in closed form, so that
    nothing is lost where returns come close, as it is by inverting Fisher's information.

    With q_k(phi) = prod_{l != k} sin^2((phi - phi_l) / 2) / sin^2((phi_k - phi_l) / 2) they are
    q_k sin(phi - phi_k) and q_k (1 - q_k'(phi_k) sin(phi - phi_k)), each less the multiple of
    prod_l sin^2((phi - phi_l) / 2), which vanishes doubly at all phases, that takes the mean away.
    """
    return by_blocks(_covariance, phase, variance, pixels=_BLOCK_PIXELS)[0]


def _covariance(phase: Array, variance: Array) -> tuple[Array]:
    m, pixels = phase.shape
    nodes = 2 * m + 1
    angle = 2 * np.pi / nodes * np.arange(nodes)
    # cos and sin of the angles less the phases
    turned = np.array([[np.cos(angle), np.sin(angle)], [np.sin(angle), -np.cos(angle)]])
    away = turned.swapaxes(1, 2).reshape((2 * nodes, 2)) @ np.stack(
        [np.cos(phase), np.sin(phase)], axis=1
    )
    zeros, sine = 1 - away[:, :nodes], away[:, nodes:]  # 2 sin^2 of the half
    values = np.empty((2 * m + 1, nodes, pixels))
    weights, phases, product = values[:m], values[m:-1], values[-1]
    scale, slope = _at_phases(phase)
    product[:] = 1.0
    for k in range(m):
        np.multiply(product, scale[k], out=weights[k])
        product *= zeros[k]
    after = zeros[-1]
    for k in range(m - 2, -1, -1):
        weights[k] *= after
        after *= zeros[k]
    np.multiply(weights, sine, out=phases)
    weights -= slope[:, None] * phases
    # the mean, and the c_j: real parts, then imaginary parts
    harmonic = np.outer(np.arange(1, m + 1), angle)
    basis = np.concatenate([np.full((1, nodes), 0.5), np.cos(harmonic), np.sin(harmonic)])
    spectrum = (2 / nodes) * basis @ values
    vanishing = spectrum[-1] / spectrum[-1, 0]
    inverse = spectrum[:-1, 1:] - spectrum[:-1, :1] * vanishing[1:]
    inverse *= np.sqrt(np.concatenate([variance, variance]))
    rows = np.ascontiguousarray(np.moveaxis(inverse, -1, 0))
    return (np.moveaxis(rows @ rows.swapaxes(1, 2), 0, -1),)


def _at_phases(phase: Array) -> tuple[Array, Array]:
    """Return what makes each q_k 1 at its phase, and its slope there, (m, P) each."""
    half = (phase[:, None] - phase) / 2
    own = np.arange(len(phase))
    half[own, own] = np.pi / 2  # a factor of 1 and a slope of 0
    sine = np.sin(half)
    return 2 / (2 * sine * sine).prod(axis=1), (np.cos(half) / sine).sum(axis=1)
