"""Levinson's recursion: from moments to the polynomial of Eq. (2), and back.

The recursion runs over the leading blocks of the Toeplitz matrix B. At order k it has the
predictor polynomial a (a_0 = 1), the error E and adds one reflection coefficient g, |g| < 1 as
long as B is positive definite (Prop. 1). Where the data leave the positive definite cone, or come
closer to its border than rounding resolves, g is projected back onto the disc and the recursion
ends there: what comes out is always a valid positive density, and `flags` marks the pixel.
"""

from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    bank,
    by_blocks,
    moment_planes,
    namespace,
    parts,
    real_type,
    summary,
    to_complex,
)
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.moment_problem import _extension as extension, _toeplitz as toeplitz
from transientcam_moments.moment_problem._toeplitz import below_one, physical, relative, step_up


class Coefficients(NamedTuple):
    """A maximum entropy density h = E / (2 pi |sum_j conj(a_j) exp(i j phi)|^2), Eq. (2).

    Attributes
    ----------
    error : array, shape (...)
        E, the prediction error, in the unit of b_0; positive wherever b_0 is.
    polynomial : array, shape (m + 1, ...)
        a_0 = 1, a_1 .. a_m; E B^-1 e_0 = a.
    reflection : array, shape (m, ...)
        g_1 .. g_m, inside the unit disc. Together with b_0 they are equivalent to the moments.
    """

    error: Array
    polynomial: Array
    reflection: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)

    @property
    def brightness(self) -> Array:
        """b_0 = E / prod (1 - |g_k|^2), shape (...), in the unit of b_0."""
        scale = self.error
        for g in self.reflection:
            scale = scale / below_one(g.real, g.imag)
        return scale


def levinson(
    b: Array, *, brightness: Array | None = None, threads: int | None = None
) -> Coefficients:
    """Solve the Toeplitz system of Theorem 1 for every pixel.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments b_0 .. b_m, complex64 or complex128; the imaginary part of b_0 is
        ignored.
    brightness : array, shape (...), optional
        Real, in place of b_0, as biasing raises it (Sec. 4.3).
    threads : int, optional
        How many threads a compiled kernel uses; all cores when left out.

    Returns
    -------
    Coefficients
        In the precision of `b`. A pixel whose matrix B is not positive definite gets the density
        of the nearest valid reflection coefficients; a pixel with b_0 <= 0 gets E = 0 and
        reflections of zero; a pixel with a NaN or an infinity gets NaN.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers, or the brightness has another shape.
    ParameterError
        For less than one thread.

    Notes
    -----
    Theorem 1 and Eq. (2) of the paper; the recursion is Levinson's and Durbin's.
    """
    planes, trailing = moment_planes(b)
    given = () if brightness is None else (_flat(brightness, trailing),)
    error, polynomial, reflection = _coefficients(planes, *given, spread=on_threads(threads))
    return Coefficients(
        error.reshape(trailing),
        polynomial.reshape((polynomial.shape[0], *trailing)),
        reflection.reshape((reflection.shape[0], *trailing)),
    )


def from_reflection(b0: Array, reflection: Array) -> Coefficients:
    """Build the density of a total brightness and reflection coefficients (step-up recursion).

    Parameters
    ----------
    b0 : array, shape (...)
        Total brightness, real and >= 0.
    reflection : array, shape (m, ...)
        g_1 .. g_m with |g_k| < 1, complex; any such set belongs to a positive density.

    Returns
    -------
    Coefficients

    Raises
    ------
    ShapeError
        When the shapes don't belong together.
    """
    reflection = as_array(reflection)
    b0 = as_array(b0)
    if reflection.ndim < 1 or not 1 <= reflection.shape[0] <= MAX_HARMONICS:
        raise ShapeError("reflection", f"of shape {tuple(reflection.shape)}", "1 to 32 planes")
    if tuple(b0.shape) != tuple(reflection.shape[1:]):
        expected = f"of shape {tuple(reflection.shape[1:])}"
        raise ShapeError("b0", f"of shape {tuple(b0.shape)}", expected)
    xp = namespace(reflection)
    error = b0.astype(real_type(reflection))
    ar, ai = [xp.ones_like(error)], [xp.zeros_like(error)]
    for k, g in enumerate(reflection, start=1):
        ar, ai = [*ar, g.real], [*ai, g.imag]
        step_up(k, ar, ai, g.real, g.imag)
        error = error * below_one(g.real, g.imag)
    return Coefficients(error, to_complex(xp.stack(ar), xp.stack(ai)), reflection)


def extend(coefficients: Coefficients, n: int) -> Array:
    """Continue the moments as the density itself does: b_{m+1} .. b_n.

    Parameters
    ----------
    coefficients : Coefficients
        Of order m.
    n : int
        Highest harmonic, n > m.

    Returns
    -------
    array, shape (n - m, ...)

    Raises
    ------
    ParameterError
        When n <= m.

    Notes
    -----
    See `moment_problem.extension`.
    """
    m = coefficients.polynomial.shape[0] - 1
    if n <= m:
        raise ParameterError("n", n, f"above the order m = {m}")
    re, im = parts(moments_of(coefficients))
    more = bank(re[0], (0,) * (n - m), 0)
    re, im = [*re, *more], [*im, *more]
    extension.extend((0,) * m, n, *parts(coefficients.polynomial), re, im)
    xp = namespace(coefficients.polynomial)
    return to_complex(xp.stack(re[m + 1 :]), xp.stack(im[m + 1 :]))


def moments_of(coefficients: Coefficients) -> Array:
    """Return the moments b_0 .. b_m of a density, shape (m + 1, ...): levinson's inverse."""
    return namespace(coefficients.polynomial).stack(_moments(coefficients))


def _moments(coefficients: Coefficients) -> list[Array]:
    """Undo the recursion: at order k, b_k = -sum_{0<j<k} a_j b_{k-j} - g_k E_{k-1}."""
    error = coefficients.brightness
    b = [error + 0 * coefficients.polynomial[0]]
    ar, ai = [error], [error]  # a_0 is in none of the sums
    for k, g in enumerate(coefficients.reflection, start=1):
        inner = sum((to_complex(ar[j], ai[j]) * b[k - j] for j in range(1, k)), start=g * error)
        b.append(-inner)
        ar, ai = [*ar, g.real], [*ai, g.imag]
        step_up(k, ar, ai, g.real, g.imag)
        error = error * below_one(g.real, g.imag)
    return b


def _flat(brightness: Array, trailing: tuple[int, ...]) -> Array:
    brightness = as_array(brightness)
    if tuple(brightness.shape) != trailing:
        found = f"of shape {tuple(brightness.shape)}"
        raise ShapeError("brightness", found, str(trailing))
    return brightness.reshape(-1)


@accelerated("levinson")
def _coefficients(b: Array, *brightness: Array) -> tuple[Array, ...]:
    return by_blocks(_levinson, b, *brightness)


def _levinson(b: Array, *brightness: Array) -> tuple[Array, Array, Array]:
    """Do as `levinson` does with planes: b (m + 1, P) to error, polynomial, reflection."""
    xp, order = namespace(b), (0,) * (b.shape[0] - 1)
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        re, im, scale = normalised(b, *brightness)
        total = re[0] * scale
        physical(order, re, im)
        ar, ai = bank(re[0], order, 1), bank(re[0], order, 1)
        gr, gi = bank(re[0], order, 0), bank(re[0], order, 0)
        error = total * toeplitz.levinson(order, re, im, ar, ai, gr, gi)
    ar[0], ai[0] = xp.ones_like(error), xp.zeros_like(error)
    return (error, to_complex(xp.stack(ar), xp.stack(ai)), to_complex(xp.stack(gr), xp.stack(gi)))


def normalised(b: Array, *brightness: Array) -> tuple[list[Array], list[Array], Array]:
    """Return the parts of moments (m + 1, P) as `relative` leaves them, and what it returns.

    b_0 is real; a brightness takes its place.
    """
    re, im = parts(b)
    re[0] = brightness[0].astype(re[0].dtype) if brightness else re[0] + 0 * im[0]
    im[0] = 0 * re[0]
    return re, im, relative((0,) * (len(re) - 1), re, im)
