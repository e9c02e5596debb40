"""Local maxima of the maximum entropy density: the range estimate of Sec. 5.3."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    Array,
    by_blocks,
    flat_planes,
    in_range,
    in_turn,
    namespace,
    repeat,
    summary,
)
from transientcam_moments.moment_problem._levinson import Coefficients
from transientcam_moments.moment_problem._maximum_entropy import modulus_floor
from transientcam_moments.moment_problem._roots import disc_roots

PEAK_THRESHOLD = 0.1
"""A peak counts when the density in it is at least this share of the highest one's."""

_STEPS = 60
_BLOCK_POLES = 1 << 16
_Poles = Sequence[tuple[Array, Array]]  # real and imaginary parts


class Peaks(NamedTuple):
    """Local maxima of a density.

    Attributes
    ----------
    first_rad : array, shape (...)
        Phase of the first one above the threshold, in [0, 2 pi); NaN where there is none.
    strongest_rad : array, shape (...)
        Phase of the highest one; NaN where there is none.
    phase_rad : array, shape (m, ...)
        All above the threshold, ascending; NaN in unused slots, which come last.
    density : array, shape (m, ...)
        The density there, in the unit of b_0 per radian; 0 in unused slots.
    """

    first_rad: Array
    strongest_rad: Array
    phase_rad: Array
    density: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def peaks(coefficients: Coefficients, *, threshold: float = PEAK_THRESHOLD) -> Peaks:
    """Find the local maxima of the density of every pixel.

    Parameters
    ----------
    coefficients : Coefficients
        Of order m.
    threshold : float
        Peaks lower than this share of the highest one don't count, 0 to 1.

    Returns
    -------
    Peaks
        At most m of them. A uniform density, a dark and an invalid pixel have none.

    Raises
    ------
    ParameterError
        For a threshold outside of 0 to 1.

    Notes
    -----
    Sec. 5.3. The search climbs from the angles of the density's poles, of which one lies in the
    basin of each peak, with Newton's method on the logarithm of the density where that is concave.
    """
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    first, strongest, phase, height = _found(
        flat_planes(coefficients.polynomial),
        flat_planes(coefficients.reflection),
        coefficients.error.reshape(-1),
        threshold,
        spread=on_threads(None),
    )
    m, trailing = len(phase), coefficients.error.shape
    return Peaks(
        first.reshape(trailing),
        strongest.reshape(trailing),
        phase.reshape((m, *trailing)),
        height.reshape((m, *trailing)),
    )


@accelerated("peaks")
def _found(a: Array, reflection: Array, error: Array, threshold: float) -> tuple[Array, ...]:
    def find(part: Array, scale: Array, least: Array) -> tuple[Array, ...]:
        return _peaks(part, scale, least, threshold)

    pixels = max(256, _BLOCK_POLES // max(1, len(reflection)))
    return by_blocks(find, a, error, modulus_floor(reflection), pixels=pixels)


def _peaks(a: Array, error: Array, floor: Array, threshold: float) -> tuple[Array, ...]:
    """Planar statement of `peaks`: polynomial (m + 1, P), error (P), floor of the modulus (P)."""
    xp = namespace(a)
    m = a.shape[0] - 1
    with np.errstate(all="ignore"):
        roots = disc_roots(list(a[1:]))
        # the search from each pole beside those from the others: (m P)
        poles = [(xp.concatenate([z.real] * m), xp.concatenate([z.imag] * m)) for z in roots]
        starts = xp.concatenate([z.real for z in roots]), xp.concatenate([z.imag for z in roots])
        x, y = _climb(*starts, poles)
        _, curvature, _, modulus = _shape(x, y, poles)
        scale, least = (xp.concatenate([each] * m) for each in (error / (2 * np.pi), floor))
        height = scale / xp.maximum(modulus, least)
        # curved like a maximum by more than rounding
        used = (curvature < -(float(np.finfo(x.dtype).eps) ** 0.5)) & (height > 0)
        height = xp.where(used, xp.minimum(height, float(np.finfo(x.dtype).max)), 0)
        phase = in_turn(xp.arctan2(y, x))
    phase, height = (each.astype(error.dtype).reshape((m, -1)) for each in (phase, height))
    order = xp.argsort(xp.where(height > 0, phase, np.inf), axis=0)
    return _select(
        xp.take_along_axis(phase, order, axis=0),
        xp.take_along_axis(height, order, axis=0),
        threshold,
    )


def _select(phase: Array, height: Array, threshold: float) -> tuple[Array, ...]:
    """Drop what was found twice and what is too low; `phase` ascends."""
    xp = namespace(phase)
    same = 2 * float(np.finfo(phase.dtype).eps) ** 0.5
    before = xp.concatenate([phase[-1:] - 2 * np.pi, phase[:-1]])
    lone = xp.concatenate([xp.zeros_like(height[:1]), height[:-1]]) == 0
    lone = lone & ((xp.arange(phase.shape[0]) > 0)[:, None] | (height[-1:] == 0))
    fresh = lone | (phase - before > same)
    strongest = height.max(axis=0)
    counts = fresh & (height > 0) & (height >= threshold * strongest)
    phase = xp.where(counts, phase, np.nan)
    height = xp.where(counts, height, 0)
    order = xp.argsort(phase, axis=0)
    phase = xp.take_along_axis(phase, order, axis=0)
    height = xp.take_along_axis(height, order, axis=0)
    at = height.argmax(axis=0)[None]
    return phase[0], xp.take_along_axis(phase, at, axis=0)[0], phase, height


def _climb(x: Array, y: Array, poles: _Poles) -> tuple[Array, Array]:
    """Climb from the angles of poles to the tops of log h = const - sum log |z - p_l|^2."""
    xp, m = namespace(x), len(poles)
    size = xp.sqrt(x * x + y * y)
    tolerance = 4 * float(np.finfo(size.dtype).eps)
    inverse = xp.where(size > 0, 1 / size, 1).astype(size.dtype)
    at = xp.where(size > 0, x * inverse, xp.ones_like(x)), y * inverse

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        x, y, around = state[1], state[2], state[3:]
        slope, curvature, near, _ = _shape(x, y, list(zip(around[:m], around[m:], strict=True)))
        reach = xp.sqrt(near) / 2
        newton = slope / xp.where(curvature < 0, -curvature, 1)
        uphill = xp.where(curvature < 0, newton, xp.where(slope > 0, reach, -reach))
        turn = xp.minimum(xp.maximum(uphill, -reach), reach)
        half = turn / 2
        shrink = 1 / (1 + half * half)
        c, s = (1 - half * half) * shrink, turn * shrink
        return (abs(turn), x * c - y * s, x * s + y * c, *around)

    infinite = xp.full(x.shape, np.inf, dtype=size.dtype)
    around = (*(p for p, _ in poles), *(q for _, q in poles))
    state = repeat(
        step,
        (infinite, *at, *around),
        times=_STEPS,
        done=lambda state: ~(state[0] > tolerance),
    )
    return state[1], state[2]


def _shape(x: Array, y: Array, poles: _Poles) -> tuple[Array, Array, Array, Array]:
    """Return slope and curvature of log h in the angle of z = x + i y, and two of its distances.

    Those are the square of that to the nearest pole, and the product of the squares to all, the
    denominator of Eq. (2). In real numbers, which are several times as fast as complex ones.
    """
    xp = namespace(x)
    least = float(np.finfo(x.dtype).tiny) * 4
    slope: Array = 0
    curvature: Array = 0
    modulus: Array = 1
    near = None
    for p, q in poles:
        u, v = x - p, y - q
        distance = u * u + v * v
        modulus = modulus * distance
        distance = xp.maximum(distance, least)
        inverse = 1 / distance
        re, im = (x * u + y * v) * inverse, (y * u - x * v) * inverse  # z / (z - p)
        slope = slope + im
        # d/dphi z / (z - p) = -i z p / (z - p)^2 and p / (z - p) = z / (z - p) - 1
        curvature = curvature + re * (re - 1) - im * im
        near = distance if near is None else xp.minimum(near, distance)
    return 2 * slope, -2 * curvature, near, modulus
