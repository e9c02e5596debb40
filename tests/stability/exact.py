"""Oracles in 60 decimal digits."""

from collections.abc import Sequence
from functools import cache

import mpmath as mp
import numpy as np

DIGITS = 60
mp.mp.dps = DIGITS


def moments(
    phase: Sequence[mp.mpf], weight: Sequence[mp.mpf], uniform: mp.mpf, m: int
) -> list[mp.mpc]:
    """Moments b_0 .. b_m of returns and a uniform part."""
    b = [
        mp.fsum((w * mp.expj(j * phi) for phi, w in zip(phase, weight, strict=True)))
        for j in range(m + 1)
    ]
    b[0] += uniform
    return [mp.mpc(value) for value in b]


def rounded(b: Sequence[mp.mpc], dtype: type) -> np.ndarray:
    """The moments in a NumPy type, shape (m + 1,)."""
    return np.array([complex(value) for value in b]).astype(dtype)


def exactly(b: np.ndarray) -> list[mp.mpc]:
    """The numbers that floats are."""
    return [mp.mpc(complex(value)) for value in np.asarray(b, complex)]


def toeplitz(b: Sequence[mp.mpc]) -> mp.matrix:
    """B[j, k] = b_{j-k}."""
    size = len(b)
    return mp.matrix(
        [[b[j - k] if j >= k else mp.conj(b[k - j]) for k in range(size)] for j in range(size)]
    )


@cache
def _eigenvalue(b: tuple[complex, ...]) -> mp.mpf:
    return min(mp.eighe(toeplitz([mp.mpc(value) for value in b]), eigvals_only=True))


def smallest_eigenvalue(b: np.ndarray) -> mp.mpf:
    """Of the moments as they were rounded; computed once for equal moments."""
    return _eigenvalue(tuple(complex(value) for value in np.asarray(b, complex)))


def levinson(b: Sequence[mp.mpc]) -> tuple[mp.mpf, list[mp.mpc], list[mp.mpc]]:
    """E, a_0 .. a_m and g_1 .. g_m of positive definite moments."""
    error = mp.re(b[0])
    a: list[mp.mpc] = []
    reflection: list[mp.mpc] = []
    for k in range(1, len(b)):
        inner = b[k] + mp.fsum(a[j - 1] * b[k - j] for j in range(1, k))
        g = -inner / error
        a = [a[j - 1] + g * mp.conj(a[k - j - 1]) for j in range(1, k)] + [g]
        error *= 1 - abs(g) ** 2
        reflection.append(g)
    return error, [mp.mpc(1), *a], reflection


def moments_of_reflection(b0: mp.mpf, reflection: Sequence[mp.mpc]) -> list[mp.mpc]:
    """The moments that belong to reflection coefficients: Levinson's recursion backwards."""
    b, error = [mp.mpc(b0)], b0
    a: list[mp.mpc] = []
    for k, g in enumerate(reflection, start=1):
        b.append(-(mp.fsum(a[j - 1] * b[k - j] for j in range(1, k)) + g * error))
        a = [a[j - 1] + g * mp.conj(a[k - j - 1]) for j in range(1, k)] + [g]
        error *= 1 - abs(g) ** 2
    return b


def moments_of_polynomial(error: mp.mpf, a: Sequence[mp.mpc]) -> list[mp.mpc]:
    """The moments of the density E / (2 pi |sum conj(a_j) e^{ij phi}|^2), by stepping down."""
    rest, reflection = list(a[1:]), []
    while rest:
        g = rest[-1]
        scale = 1 - abs(g) ** 2
        error /= scale
        k = len(rest)
        rest = [(rest[j] - g * mp.conj(rest[k - 2 - j])) / scale for j in range(k - 1)]
        reflection.append(g)
    return moments_of_reflection(error, reflection[::-1])


def distance(found: Sequence[mp.mpc], b: Sequence[mp.mpc]) -> float:
    """Largest difference of moments relative to b_0."""
    return float(max(abs(x - y) for x, y in zip(found, b, strict=True)) / abs(b[0]))


@cache
def conditions(
    phase: tuple[mp.mpf, ...], weight: tuple[mp.mpf, ...], m: int
) -> tuple[list[float], list[float]]:
    """How much each phase (absolutely) and weight (relatively) may move by rounding b.

    The largest change for moments that change by b_0 times one unit in each component: row sums of
    the pseudo-inverse of the derivative of the moments by phases, weights and uniform part.
    """
    count = len(phase)
    rows = 2 * m + 1
    derivative = mp.zeros(rows, 2 * count + 1)
    derivative[0, 2 * count] = 1
    for k, (phi, w) in enumerate(zip(phase, weight, strict=True)):
        for j in range(m + 1):
            wave = mp.expj(j * phi)
            turned = mp.mpc(0, j) * w * wave
            derivative[j, k], derivative[j, count + k] = mp.re(turned), mp.re(wave)
            if j:
                derivative[m + j, k] = mp.im(turned)
                derivative[m + j, count + k] = mp.im(wave)
    inverse = mp.inverse(derivative.T * derivative) * derivative.T
    total = mp.fsum(weight)
    sums = [
        mp.fsum(abs(inverse[row, column]) for column in range(rows)) for row in range(2 * count)
    ]
    phases = [float(sums[k] * total) for k in range(count)]
    weights = [float(sums[count + k] * total / weight[k]) for k in range(count)]
    return phases, weights
