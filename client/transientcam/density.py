"""The impulse response of every pixel, from streamed coefficients and in plain numpy.

C. Peters, J. Klein, M. B. Hullin, R. Klein: Solving Trigonometric Moment Problems for Fast
Transient Imaging, ACM Transactions on Graphics 34(6), 2015, Eq. (2).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from transientcam.errors import ParameterError


def density(coefficients: ArrayLike, phase_rad: ArrayLike) -> NDArray[np.floating[Any]]:
    """Evaluate the maximum entropy spectral estimate at some phases.

    Parameters
    ----------
    coefficients : array_like, shape (2m + 1, ...)
        E in DN, then Re a_1, Im a_1 to Re a_m, Im a_m: the product ``coefficients``, or its frame.
    phase_rad : array_like, any shape T
        Phases in rad; 2 pi is the unambiguous range.

    Returns
    -------
    ndarray, shape T + (...)
        The density in DN per rad, in the precision of the coefficients. NaN where they are NaN.

    Raises
    ------
    ParameterError
        If ``coefficients`` is not real or its first axis not odd.
    """
    given = np.asarray(coefficients)
    if given.dtype.kind not in "fiu":
        raise ParameterError("coefficients", given.dtype.str, "real")
    if given.ndim == 0 or given.shape[0] % 2 == 0:
        raise ParameterError("coefficients", given.shape, "of shape (2m + 1, ...)")
    planes = given if given.dtype.kind == "f" else given.astype(np.float64)
    phases = np.asarray(phase_rad, dtype=np.float64)
    harmonics = np.arange(1, planes.shape[0] // 2 + 1)
    # Eq. (2): h = E / (2 pi |sum_j conj(a_j) exp(i j phi)|^2) with a_0 = 1. The squared modulus
    # keeps its digits at a peak, where the Fourier series of the same denominator cancels.
    angle = phases.reshape(-1, 1) * harmonics
    cosine = np.cos(angle).astype(planes.dtype)
    sine = np.sin(angle).astype(planes.dtype)
    flat = planes.reshape(planes.shape[0], -1)
    energy, real, imaginary = flat[0], flat[1::2], flat[2::2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a pixel without light
        result: NDArray[np.floating[Any]] = (
            cosine @ real + sine @ imaginary + planes.dtype.type(1.0)
        ) ** 2
        result += (sine @ real - cosine @ imaginary) ** 2
        np.divide(energy / planes.dtype.type(2.0 * np.pi), result, out=result)
    return result.reshape(phases.shape + planes.shape[1:])


def transient(
    coefficients: ArrayLike, time_s: ArrayLike, *, base_frequency_hz: float
) -> NDArray[np.floating[Any]]:
    """Evaluate the impulse response at some times of flight.

    Parameters
    ----------
    coefficients : array_like, shape (2m + 1, ...)
        As for `density`.
    time_s : array_like, any shape T
        Times of flight in s.
    base_frequency_hz : float
        The frequency of the first harmonic: ``frame.meta["base_frequency_hz"]``.

    Returns
    -------
    ndarray, shape T + (...)
        The impulse response in DN per s: ``g(tau) = 2 pi f h(2 pi f tau)``, periodic in 1 / f.

    Raises
    ------
    ParameterError
        As `density`, and if the frequency is not a number above 0.
    """
    if not 0.0 < base_frequency_hz < float("inf"):
        raise ParameterError("base_frequency_hz", base_frequency_hz, "a number of Hz above 0")
    angular_rad_s = 2.0 * np.pi * float(base_frequency_hz)
    # The wrap is done in cycles: float64 phases of many turns would lose digits in the sine.
    cycles = np.asarray(time_s, dtype=np.float64) * float(base_frequency_hz)
    result = density(coefficients, 2.0 * np.pi * (cycles - np.floor(cycles)))
    result *= result.dtype.type(angular_rad_s)
    return result


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
