"""Slow and obvious: what the planar algorithms are compared with."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Complex = NDArray[np.complexfloating[Any, Any]]
Real = NDArray[np.floating[Any]]


def moments_of_returns(phase_rad: ArrayLike, weight: ArrayLike, m: int) -> Complex:
    """Moments b_0 .. b_m (m + 1, ...) of returns (K, ...), by their definition."""
    phase, weight = np.asarray(phase_rad, float), np.asarray(weight, float)
    return np.stack([(weight * np.exp(1j * j * phase)).sum(axis=0) for j in range(m + 1)])


def random_returns(
    rng: np.random.Generator, *, returns: int, pixels: int, apart_rad: float = 0.0
) -> tuple[Real, Real]:
    """Ascending phases and weights 0.05 .. (returns, pixels), at least `apart_rad` apart."""
    free = 2 * np.pi - returns * apart_rad
    start = np.sort(rng.uniform(0, free, (returns, pixels)), axis=0)
    phase = start + apart_rad * (np.arange(returns)[:, None] + rng.random(pixels))
    phase = np.sort(phase % (2 * np.pi), axis=0)
    return phase, rng.exponential(size=phase.shape) + 0.05


def random_moments(rng: np.random.Generator, m: int, pixels: int, *, noise: float = 0.0) -> Complex:
    """Moments of more returns than m, with a uniform part; valid unless there is noise."""
    phase, weight = random_returns(rng, returns=2 * m + 3, pixels=pixels)
    b = moments_of_returns(phase, weight, m)
    b[0] *= 1.05
    b += noise * b[0].real * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape))
    b[0] = b[0].real
    return b


def toeplitz(b: Complex) -> Complex:
    """Hermitian Toeplitz matrices (..., m + 1, m + 1) with B[j, k] = b_{j-k}."""
    size = b.shape[0]
    matrix = np.empty((*b.shape[1:], size, size), complex)
    for j in range(size):
        for k in range(size):
            matrix[..., j, k] = b[j - k] if j > k else b[k - j].conj()
        matrix[..., j, j] = b[0].real
    return matrix


def smallest_eigenvalue(b: Complex) -> Real:
    """By LAPACK, in double precision."""
    values: Real = np.linalg.eigvalsh(toeplitz(b))
    return values[..., 0]


def first_column_of_inverse(b: Complex) -> Complex:
    """B^-1 e_0, (m + 1, ...), by a dense solve."""
    unit = np.zeros((*b.shape[1:], b.shape[0], 1))
    unit[..., 0, 0] = 1
    return np.moveaxis(np.linalg.solve(toeplitz(b), unit)[..., 0], -1, 0)


def density(b: Complex, phase_rad: Sequence[float] | Real) -> Real:
    """Eq. (2) as it is printed, (T, ...)."""
    column = first_column_of_inverse(b)
    wave = np.exp(1j * np.outer(np.asarray(phase_rad), np.arange(b.shape[0])))
    below = np.abs(np.tensordot(wave, column.conj(), axes=1)) ** 2
    h: Real = column[0].real / (2 * np.pi * below)
    return h


def moments_of_density(density: Real, phase_rad: Real, m: int) -> Complex:
    """Moments of a density given on a full turn of equidistant phases: exact for smooth ones."""
    step = 2 * np.pi / phase_rad.size
    wave = np.exp(1j * np.outer(np.arange(m + 1), phase_rad)) * step
    moments: Complex = np.tensordot(wave, density, axes=1)
    return moments


def around(difference: ArrayLike) -> Real:
    """Distance of angles on the circle."""
    turned: Real = np.abs((np.asarray(difference) + np.pi) % (2 * np.pi) - np.pi)
    return turned


Content = Mapping[int, complex]
SQUARE = {k: (-1) ** ((k - 1) // 2) / k for k in range(1, 400, 2)}
"""Fourier coefficients of a square wave over those of its fundamental: 4 / (pi k), in turn."""


def correlation(content: Content, theta_rad: float, b: Content) -> float:
    """Correlation at one phase: I = sum_k Re(c_k b_k exp(-i k theta)) (usb-protocol 5.5)."""
    return float(sum((c * b[k] * np.exp(-1j * k * theta_rad)).real for k, c in content.items()))


def phasor(content: Content, offset_rad: float, b: Content) -> complex:
    """Four-bucket phasor of Sec. 3.1, from its definition."""
    i = [correlation(content, offset_rad + q * np.pi / 2, b) for q in range(4)]
    return complex(i[0] - i[2], i[1] - i[3])
