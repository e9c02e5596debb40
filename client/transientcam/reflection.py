"""Reflection coefficients: the same density as the polynomial of Eq. (2), in numbers of the disc.

Levinson's recursion adds one reflection coefficient g_k an order; a density is positive if and
only if all of them lie inside the unit disc. Here are the two ways between both descriptions. The
names are those of docs/stream.md: E, a_1 .. a_m, b_0.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_Complex = NDArray[np.complexfloating[Any, Any]]


def step_down(coefficients: NDArray[np.floating[Any]]) -> tuple[NDArray[np.float64], _Complex]:
    """Return brightness and reflection coefficients of some densities.

    Parameters
    ----------
    coefficients : ndarray, shape (2m + 1, ...)
        E, then Re a_1, Im a_1 to Re a_m, Im a_m: the product ``coefficients``.

    Returns
    -------
    brightness : ndarray, shape (...)
        b_0 = E / prod (1 - |g_k|^2), float64.
    reflection : ndarray, shape (m, ...)
        g_1 to g_m, complex128. NaN where the coefficients are.
    """
    planes = np.asarray(coefficients, dtype=np.float64)
    a = [real + 1j * imaginary for real, imaginary in zip(planes[1::2], planes[2::2], strict=True)]
    brightness = planes[0].copy()
    reflection = np.empty((len(a), *brightness.shape), dtype=np.complex128)
    with np.errstate(divide="ignore", invalid="ignore"):  # |g| = 1: a density without width
        for k in range(len(a), 0, -1):
            g = reflection[k - 1] = a.pop()
            scale = 1.0 / (1.0 - _squared(g))
            brightness *= scale
            # a_j of order k - 1 is (a_j - g_k conj(a_{k-j})) / (1 - |g_k|^2)
            a = [
                (each - g * np.conj(mirror)) * scale
                for each, mirror in zip(a, a[::-1], strict=True)
            ]
    return brightness, reflection


def step_up(brightness: NDArray[Any], reflection: _Complex) -> NDArray[np.float64]:
    """Return the product ``coefficients`` for reflection coefficients: undo `step_down`.

    Parameters
    ----------
    brightness : ndarray, shape (...)
        b_0.
    reflection : ndarray, shape (m, ...)
        g_1 to g_m, complex, each inside the unit disc.

    Returns
    -------
    ndarray, shape (2m + 1, ...)
        E, Re a_1, Im a_1 to Re a_m, Im a_m, float64; NaN where the brightness is.
    """
    error = np.array(brightness, dtype=np.float64)
    a: list[_Complex] = []
    for g in reflection:
        # a_j of order k is a_j + g_k conj(a_{k-j}), and a_k = g_k
        a = [each + g * np.conj(mirror) for each, mirror in zip(a, a[::-1], strict=True)] + [g]
        error *= 1.0 - _squared(g)
    planes = np.empty((2 * len(a) + 1, *error.shape))
    planes[0] = error
    for k, each in enumerate(a):
        planes[2 * k + 1] = each.real
        planes[2 * k + 2] = each.imag
    planes[:, np.isnan(error)] = np.nan
    return planes


def _squared(value: _Complex) -> NDArray[np.floating[Any]]:
    squared: NDArray[np.floating[Any]] = value.real**2 + value.imag**2
    return squared
