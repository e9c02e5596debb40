"""Levinson's recursion: from moments to the polynomial of Eq. (2), and back.

The recursion runs over the leading blocks of the Toeplitz matrix B. At order k it has the
predictor polynomial a (a_0 = 1), the error E and adds one reflection coefficient g, |g| < 1 as
long as B is positive definite (Prop. 1). Where the data leave the positive definite cone, or come
closer to its border than rounding resolves, g is projected back onto the disc and the recursion
ends there: what comes out is always a valid positive density, and `flags` marks the pixel.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    below_one,
    by_blocks,
    moment_planes,
    namespace,
    real_type,
    root_and_inverse,
    some,
    squared,
    summary,
)
from transientcam_moments.errors import ParameterError, ShapeError


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
            scale = scale / below_one(g)
        return scale


class Recursion(NamedTuple):
    """What Levinson's recursion returns for one block of pixels with b_0 = 1.

    Attributes
    ----------
    errors : list of m + 1 real planes
        E_0 .. E_m.
    polynomial : list of m complex planes
        a_1 .. a_m (a_0 = 1 is not stored).
    reflection : list of m complex planes
        g_1 .. g_m.
    order : integer plane
        The order at which the border was met, 0 where there is no light, m where it never was.
    """

    errors: list[Array]
    polynomial: list[Array]
    reflection: list[Array]
    order: Array


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
        How many threads a compiled lane uses; all cores when left out.

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
    a: list[Array] = []
    for g in reflection:
        a = _step_up(a, g)
        error = error * below_one(g)
    return Coefficients(error, xp.stack([xp.ones_like(reflection[0]), *a]), reflection)


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
    b_k = -sum_j a_j b_{k-j}: the density of Eq. (2) is that of an autoregressive process.
    """
    a = coefficients.polynomial
    m = a.shape[0] - 1
    if n <= m:
        raise ParameterError("n", n, f"above the order m = {m}")
    b = _moments(coefficients)
    for k in range(m + 1, n + 1):
        b.append(predicted(a, b, k))
    return namespace(a).stack(b[m + 1 :])


def moments_of(coefficients: Coefficients) -> Array:
    """Return the moments b_0 .. b_m of a density, shape (m + 1, ...): levinson's inverse."""
    return namespace(coefficients.polynomial).stack(_moments(coefficients))


def _moments(coefficients: Coefficients) -> list[Array]:
    """Undo the recursion: at order k, b_k = -sum_{0<j<k} a_j b_{k-j} - g_k E_{k-1}."""
    error = coefficients.brightness
    b = [error + 0 * coefficients.polynomial[0]]
    a: list[Array] = []
    for k, g in enumerate(coefficients.reflection, start=1):
        inner = sum((a[j - 1] * b[k - j] for j in range(1, k)), start=g * error)
        b.append(-inner)
        a = _step_up(a, g)
        error = error * below_one(g)
    return b


def predicted(a: Array, b: list[Array], k: int) -> Array:
    """Return b_k from b_{k-m} .. b_{k-1} and the polynomial a of order m, see `extend`."""
    total = a[1] * b[k - 1]
    for j in range(2, a.shape[0]):
        total = total + a[j] * b[k - j]
    return -total


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
    """Planar statement of `levinson`: b (m + 1, P) to error, polynomial, reflection."""
    xp = namespace(b)
    if brightness:
        b = xp.concatenate([brightness[0][None].astype(b.dtype), b[1:]])
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        relative, scale = normalised(b)
        floor = 4 * float(np.finfo(scale.dtype).eps)
        result = recursion(_physical(relative), [floor] * (len(b) - 1), into_disc(floor))
        error = result.errors[-1] * (relative[0] * scale)
    one = xp.ones_like(b[0])
    return error, xp.stack([one, *result.polynomial]), xp.stack(result.reflection)


def normalised(b: Array) -> tuple[list[Array], Array]:
    """Divide moments by the largest of them, which is b_0 for every physical pixel.

    Returns
    -------
    planes : list of m + 1 planes
        The first one is real: 1, or less where b_0 is not the largest moment.
    scale : real plane
        What the planes have to be multiplied with; 0 where everything is 0.

    Notes
    -----
    Tiny and huge pixels are brought into the middle of the exponent range first: the reciprocal
    of either would leave it.
    """
    xp = namespace(b)
    limits = np.finfo(real_type(b))
    middle = 2.0 ** (limits.maxexp * 3 // 4)
    # an infinity or a NaN anywhere makes all of the pixel NaN
    scale = abs(b[0].real) + 0 * b[0].imag
    for plane in b[1:]:
        scale = xp.maximum(scale, xp.maximum(abs(plane.real), abs(plane.imag)))
    scale = scale + 0 * scale
    planes = [b[0].real, *b[1:]]
    near = scale
    outside = (scale < 1 / middle) | (scale > middle)
    if some(outside):
        lift = xp.where(scale < 1 / middle, middle, xp.where(outside, 1 / middle, 1.0))
        lift = lift.astype(scale.dtype)
        planes = [plane * lift for plane in planes]
        near = scale * lift
    lit = near > 0
    inverse = xp.where(
        lit, 1 / xp.where(lit, near, xp.ones_like(near)), near
    )  # 0 and NaN stay what they are
    return [plane * inverse for plane in planes], scale


def _physical(b: list[Array]) -> list[Array]:
    """Divide by b_0 and bring moments larger than 2 b_0 back to that, so that nothing overflows.

    |b_k| <= b_0 for every density; a pixel that breaks this is projected onto the border of the
    cone anyway, and only the direction of b_k still counts.
    """
    xp = namespace(b[1])
    b0 = b[0]
    broken = ~(b0 >= 1)
    if not some(broken):
        return b
    tiny = 4 * float(np.finfo(b0.dtype).tiny)
    lit = b0 > tiny
    inverse = xp.where(lit, 1 / xp.where(lit, b0, xp.ones_like(b0)), 0 * b0)
    planes = [b0 * inverse]
    for plane in b[1:]:
        square = squared(plane)
        size, reciprocal = root_and_inverse(square)
        factor = xp.where((square > 0) & (size > 2 * b0), 2 * reciprocal, inverse)
        planes.append(plane * xp.where(planes[0] > 0, factor, 0 * b0))
    return planes


Border = Callable[[Array, Array], tuple[Array, Array]]
"""Takes g_k / |g_k| and E_{k-1} at the border of the cone; returns g_k and E_k there."""


def recursion(b: list[Array], floors: Sequence[float], border: Border) -> Recursion:
    """Run Levinson's recursion over planes with b_0 = 1, or 0 where there is no light (Theorem 1).

    Parameters
    ----------
    b : list of m + 1 planes
        The first one real.
    floors : sequence of m float
        The border of the cone is where E_k falls to the k-th of them: less than rounding leaves of
        it. From there on all reflection coefficients are zero.
    border : callable
        What becomes of g_k at the border: `into_disc` for densities, `onto_circle` for returns.
    """
    xp = namespace(b[1])
    error = b[0]  # E_0 = b_0
    errors = [error]
    a: list[Array] = []
    reflection: list[Array] = []
    alive = error > 0
    order = xp.where(alive, len(b) - 1, 0)
    for k, floor in enumerate(floors, start=1):
        # Levinson: g_k = -(b_k + sum_{0<j<k} a_j b_{k-j}) / E_{k-1}
        inner = b[k]
        for j in range(1, k):
            inner = inner + a[j - 1] * b[k - j]
        divisor = xp.where(alive, error, xp.ones_like(error)) if some(~alive) else error
        g = inner * (-1 / divisor)
        remaining = error * below_one(g)  # E_k = E_{k-1} (1 - |g_k|^2)
        ends = alive & ~(remaining > floor)
        if some(ends | ~alive):
            square = squared(g)
            unit = xp.where(square > 0, g * root_and_inverse(square)[1], xp.ones_like(g))
            at_border = border(unit, divisor)
            # NaN belongs to an invalid pixel, which keeps it; what comes after the border is zero
            g = xp.where(alive, xp.where(ends, at_border[0], g), 0 * b[k])
            remaining = xp.where(alive, xp.where(ends, at_border[1], remaining), error)
            order = xp.where(ends, k, order)
            alive = alive & ~ends
        a = _step_up(a, g)
        error = remaining
        errors.append(error)
        reflection.append(g)
    return Recursion(errors, a, reflection, order.astype(np.int32))


def into_disc(floor: float) -> Border:
    """Project g_k into the unit disc so that E_k is ``floor``: the density stays positive."""

    def border(unit: Array, error: Array) -> tuple[Array, Array]:
        rest = 1 - floor / error
        g = unit * namespace(unit).where(rest > 0, root_and_inverse(rest)[0], 0 * rest)
        return g, error * below_one(g)  # E_k that belongs to the rounded g_k

    return border


def onto_circle(unit: Array, error: Array) -> tuple[Array, Array]:
    """Project g_k onto the unit circle: k sharp returns (Theorem 2), whose E_k = 0 is not used."""
    return unit, error


def _step_up(a: list[Array], g: Array) -> list[Array]:
    """Raise the order by one (Durbin): a_j + g conj(a_{k-j}), a_k = g."""
    k = len(a) + 1
    return [a[j - 1] + g * a[k - j - 1].conj() for j in range(1, k)] + [g]
