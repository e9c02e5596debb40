"""The obvious way with batched LAPACK through NumPy, for comparison."""

from typing import NamedTuple

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import Array


class Estimate(NamedTuple):
    """What the obvious way finds, pixels (P) first."""

    coefficients: Array
    range_m: Array
    direct: Array
    indirect: Array
    validity: Array


def toeplitz(b: Array) -> Array:
    """Toeplitz matrices (P, m + 1, m + 1) of moments (m + 1, P)."""
    order = b.shape[0]
    lag = np.arange(order)[:, None] - np.arange(order)
    return np.moveaxis(np.concatenate([b, b[:0:-1].conj()])[lag], -1, 0)


def coefficients(matrix: Array) -> Array:
    """Return B^-1 e_0 (P, m + 1) by `numpy.linalg.solve`."""
    unit = np.zeros((matrix.shape[0], matrix.shape[1], 1), matrix.dtype)
    unit[:, 0] = 1
    solved: Array = np.linalg.solve(matrix, unit)[..., 0]
    return solved


def returns(matrix: Array, b: Array) -> tuple[Array, Array, Array]:
    """Return phases, weights (P, m) and smallest eigenvalues (P) by `eigh` and `eigvals`.

    The eigenvector's polynomial gets its roots from companion matrices, the weights come from
    Vandermonde systems.
    """
    values, vectors = np.linalg.eigh(matrix)
    m = b.shape[0] - 1
    polynomial = vectors[:, ::-1, 0].conj()  # highest power first
    companion = np.zeros((len(polynomial), m, m), polynomial.dtype)
    companion[:, 1:, :-1] = np.eye(m - 1)
    companion[:, 0] = -polynomial[:, 1:] / polynomial[:, :1]
    nodes = np.linalg.eigvals(companion)
    phase = np.angle(nodes) % (2 * np.pi)
    nodes = np.exp(1j * phase).astype(matrix.dtype)
    vandermonde = nodes[:, None, :] ** np.arange(m)[:, None]
    right = b[:m].T.astype(matrix.dtype).copy()
    right[:, 0] -= values[:, 0]
    weight = np.linalg.solve(vandermonde, right[..., None])[..., 0].real
    return phase, weight, values[:, 0]


def reconstruct(images: Array, settings: tm.Settings) -> Estimate:
    """Reconstruct raw images (N, H, W) of a capture with a low frequency."""
    with np.errstate(all="ignore"):
        phasors = images.reshape(-1, 4, *images.shape[1:]).astype(np.float32)
        moments = (phasors[:, 0] - phasors[:, 2]) + 1j * (phasors[:, 1] - phasors[:, 3])
        moments[0] = np.abs(moments[0])
        b = tm.smooth(moments, settings.smoothing_sigma_px).reshape(len(moments), -1)
        matrix = toeplitz(b)
        phase, weight, smallest = returns(matrix, b)
        b0 = b[0].real
        raised = np.where(smallest < settings.epsilon * b0, b0 - smallest, 0) / (
            1 - settings.epsilon
        )
        matrix = matrix + (np.maximum(raised - b0, 0))[:, None, None] * np.eye(len(b))
        solved = coefficients(matrix.astype(b.dtype))
        order = np.argsort(phase, axis=1)
        phase, weight = (np.take_along_axis(part, order, axis=1) for part in (phase, weight))
        enough = weight >= settings.threshold * weight.max(axis=1, keepdims=True)
        first = enough.argmax(axis=1)[:, None]
        direct = np.take_along_axis(weight, first, axis=1)[:, 0]
        range_m = tm.range_m(
            np.take_along_axis(phase, first, axis=1)[:, 0], settings.base_frequency_hz or 0.0
        )
        return Estimate(solved, range_m, direct, weight.sum(axis=1) - direct, smallest / b0)
