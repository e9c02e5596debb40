"""Sharp bounds on every smoothed density with given moments (Sec. 5.2)."""

import numpy as np

from transientcam_moments.arrays import (
    Array,
    flat_planes,
    in_range,
    namespace,
    phases,
    real_type,
    squared,
)
from transientcam_moments.moment_problem._levinson import Coefficients, levinson

RADIUS = 0.93
"""The paper's radius of the Poisson kernel (Fig. 7)."""

_LIMIT = "0 <= radius < 1"


def bounds(b: Array, phase_rad: Array, radius: float = RADIUS) -> tuple[Array, Array]:
    """Return the least and the greatest smoothed density that the moments allow.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments with a positive definite Toeplitz matrix (see `bias`).
    phase_rad : array, shape (T,)
        Phases in radian.
    radius : float
        Of the Poisson kernel that densities are smoothed with, 0 <= radius < 1.

    Returns
    -------
    lower, upper : array, shape (T, ...)
        In the unit of b_0 per radian. They say nothing about noise; after biasing they hold for the
        biased moments.

    Raises
    ------
    ParameterError
        For a radius outside of [0, 1).
    ShapeError
        When `b` or `phase_rad` has a wrong shape.

    Notes
    -----
    After Karlsson and Georgiou (2013). The Caratheodory functions of all densities with these
    moments take the values of a disc at w = radius exp(i phi). It is the image of the disc
    |zeta| <= radius under the Mobius maps of the reflection coefficients, the last one first.
    """
    in_range("radius", radius, 0.0, float(np.nextafter(1.0, 0.0)), _LIMIT)
    coefficients = levinson(b)
    centre, disc = _smoothed(coefficients, phase_rad, radius, spread=1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        return centre - disc, centre + disc


def smoothed_density(coefficients: Coefficients, phase_rad: Array, radius: float = RADIUS) -> Array:
    """Return the maximum entropy density smoothed with the Poisson kernel, in closed form.

    Parameters
    ----------
    coefficients : Coefficients
        Of order m.
    phase_rad : array, shape (T,)
        Phases in radian.
    radius : float
        Of the Poisson kernel, 0 <= radius < 1: 0 gives the mean density everywhere.

    Returns
    -------
    array, shape (T, ...)
        In the unit of b_0 per radian; inside of `bounds`.

    Raises
    ------
    ParameterError
        For a radius outside of [0, 1).

    Notes
    -----
    Sec. 5.2. It is the point of the disc of `bounds` that comes from zeta = 0: the reflection
    coefficients beyond m are zero.
    """
    in_range("radius", radius, 0.0, float(np.nextafter(1.0, 0.0)), _LIMIT)
    return _smoothed(coefficients, phase_rad, radius, spread=0.0)[0]


def _smoothed(
    coefficients: Coefficients, phase_rad: Array, radius: float, *, spread: float
) -> tuple[Array, Array]:
    """Give `_disc` flat planes and its results their shape back."""
    reflection = flat_planes(coefficients.reflection)
    xp = namespace(reflection)
    phase = phases(phase_rad, like=reflection)
    b0 = coefficients.brightness.reshape(-1)
    points = radius * (xp.cos(phase) + 1j * xp.sin(phase))
    shape = (phase.shape[0], *coefficients.error.shape)
    scale = (b0 / (2 * np.pi)).astype(real_type(reflection))
    with np.errstate(all="ignore"):
        values = _disc(reflection, points.astype(reflection.dtype), spread)
        centre, size = ((value * scale).reshape(shape) for value in values)
    return centre, size


def _disc(reflection: Array, w: Array, spread: float) -> tuple[Array, Array]:
    """Map the disc |zeta| <= spread through all reflections, at w (T) for planes (m, P).

    Returns
    -------
    centre, radius : real array, shape (T, P)
        Of the real part of F / b_0, F = (1 + zeta) / (1 - zeta).

    Notes
    -----
    The Schur function of order k is f_{k-1} = (w f_k - conj(g)) / (1 - w f_k g), where
    zeta = w f. A Mobius map (z + p) / (z q + 1) takes the disc (c, s) to the centre
    ((c + p) conj(1 + q c) - conj(q) s^2) / d and the radius |1 - p q| s / d with
    d = |1 + q c|^2 - |q|^2 s^2.
    """
    xp = namespace(reflection)
    w = w[:, None]
    size = xp.sqrt(squared(w))
    centre = xp.zeros_like(w * reflection[0])
    radius = spread * size * xp.ones_like(reflection[0].real)
    for g in reflection[::-1]:
        p, q = -g.conj(), -g
        # zeta = w f_{k-1} for the disc of zeta = w f_k
        below = 1 + q * centre
        inverse = 1 / (squared(below) - squared(q) * radius * radius)
        centre = w * (((centre + p) * below.conj() - q.conj() * radius * radius) * inverse)
        radius = size * radius * (1 - squared(g)) * inverse
    # F = (1 + zeta) / (1 - zeta) = -1 + 2 / (1 - zeta); 2 / (1 - zeta) maps the disc again
    below = 1 - centre
    inverse = 1 / (squared(below) - radius * radius)
    return 2 * below.real * inverse - 1, 2 * radius * inverse
