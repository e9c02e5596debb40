"""ESPRIT, MUSIC and minimum norm beside the matrix pencil: one snapshot, the same subspace.

They are not techniques of their own here. With one snapshot each of them takes the K strongest
singular vectors of the Hankel matrix that the pencil takes; without noise they find the same
returns, with noise they are as good.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.moments import oracles
from transientcam_moments.comparisons._matrix_pencil import matrix_pencil

Complex = NDArray[Any]
Real = NDArray[Any]
M, RETURNS, DRAWS = 9, 2, 300
PHASE = np.array([1.0, 2.6])
WEIGHT = np.array([1.0, 0.6])


def left_vectors(c: Complex) -> Complex:
    rows = (len(c) + 1) // 2 + 1
    return np.linalg.svd(c[np.arange(rows)[:, None] + np.arange(len(c) - rows + 1)])[0]


def esprit(c: Complex) -> Complex:
    """Roy and Kailath 1989: the rotation of the signal subspace by one step."""
    signal = left_vectors(c)[:, :RETURNS]
    return np.linalg.eigvals(np.linalg.pinv(signal[:-1]) @ signal[1:])


def root_music(c: Complex) -> Complex:
    """Barabell 1983: roots of the noise subspace's squared projection nearest to the circle."""
    noise = left_vectors(c)[:, RETURNS:]
    projection = noise @ noise.conj().T
    size = len(projection)
    roots = np.roots([np.trace(projection, k) for k in range(size - 1, -size, -1)])
    return nearest(roots[np.abs(roots) < 1 + 1e-6])  # they come in pairs z, 1 / conj(z)


def minimum_norm(c: Complex) -> Complex:
    """Kumaresan and Tufts 1983: the shortest vector of the noise subspace that begins with 1."""
    noise = left_vectors(c)[:, RETURNS:]
    vector = noise @ noise[0].conj()
    return nearest(np.roots(vector[::-1].conj()))


def nearest(roots: Complex) -> Complex:
    """Return the K roots nearest to the unit circle; without noise double ones count once."""
    near = roots[np.argsort(np.abs(1 - np.abs(roots)))]
    apart = [near[0]]
    apart += [root for root in near[1:] if np.abs(root - apart[0]) > 1e-3][: RETURNS - 1]
    return np.array(apart)


def phases(method: Callable[[Complex], Complex], b: Complex) -> Real:
    return np.stack([np.sort(np.angle(method(c))) for c in b[1:].T], axis=1)


@pytest.mark.parametrize("method", [esprit, root_music, minimum_norm])
def test_without_noise_they_find_the_returns_of_the_matrix_pencil(
    method: Callable[[Complex], Complex],
) -> None:
    b = oracles.moments_of_returns(PHASE[:, None], WEIGHT[:, None], M)

    pencil = np.sort(np.asarray(matrix_pencil(b, returns=RETURNS).phase_rad), axis=0)

    np.testing.assert_allclose(phases(method, b), pencil, atol=1e-6)


@pytest.mark.parametrize("method", [esprit, root_music, minimum_norm])
def test_with_noise_they_are_as_good_as_the_matrix_pencil(
    method: Callable[[Complex], Complex],
) -> None:
    rng = np.random.default_rng(1)
    b = oracles.moments_of_returns(PHASE[:, None], WEIGHT[:, None], M)
    b = b + 1.6 / 70 * (rng.normal(size=(M + 1, DRAWS)) + 1j * rng.normal(size=(M + 1, DRAWS)))

    pencil = np.sort(np.asarray(matrix_pencil(b, returns=RETURNS).phase_rad), axis=0)

    error = np.std(phases(method, b) - PHASE[:, None])
    assert 0.6 < error / np.std(pencil - PHASE[:, None]) < 1.6
