"""Local maxima of the maximum entropy density: the range estimate of Sec. 5.3."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from transientcam_moments._arrays import (
    Array,
    by_blocks,
    flat_planes,
    in_range,
    in_turn,
    namespace,
    squared,
    to_complex,
)
from transientcam_moments._loops import repeat
from transientcam_moments._shown import summary
from transientcam_moments.levinson import Coefficients
from transientcam_moments.maximum_entropy import modulus_floor
from transientcam_moments.roots import disc_roots

PEAK_THRESHOLD = 0.1
"""A peak counts when the density in it is at least this share of the highest one's."""

_STEPS = 60


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
    a, error = flat_planes(coefficients.polynomial), coefficients.error.reshape(-1)
    m = a.shape[0] - 1
    floor = modulus_floor(coefficients.reflection).reshape(-1)

    def find(part: Array, scale: Array, least: Array) -> tuple[Array, ...]:
        return _peaks(part, scale, least, threshold)

    first, strongest, phase, height = by_blocks(find, a, error, floor)
    trailing = coefficients.error.shape
    return Peaks(
        first.reshape(trailing),
        strongest.reshape(trailing),
        phase.reshape((m, *trailing)),
        height.reshape((m, *trailing)),
    )


def _peaks(a: Array, error: Array, floor: Array, threshold: float) -> tuple[Array, ...]:
    """Planar statement of `peaks`: polynomial (m + 1, P), error (P), floor of the modulus (P)."""
    xp = namespace(a)
    with np.errstate(all="ignore"):
        poles = disc_roots(list(a[1:]))
        phases, heights = [], []
        for pole in poles:
            top = _climb(pole, poles)
            phases.append(in_turn(xp.arctan2(top.imag, top.real)).astype(error.dtype))
            height = error / (2 * np.pi) / xp.maximum(_modulus(top, poles), floor)
            heights.append(xp.where(_is_peak(top, poles) & (height > 0), height, 0))
        height = xp.minimum(xp.stack(heights), float(np.finfo(error.dtype).max))
    phase, height = xp.stack(phases), height.astype(error.dtype)
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


def _climb(start: Array, poles: list[Array]) -> Array:
    """Climb from the angle of one pole to the top of log h = const - sum log |z - p_l|^2."""
    xp = namespace(start)
    size = xp.sqrt(squared(start))
    tolerance = 4 * float(np.finfo(size.dtype).eps)
    at = start * xp.where(size > 0, 1 / size, 1).astype(size.dtype)
    at = xp.where(size > 0, at, xp.ones_like(at))

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        z, around = state[1], state[2:]
        slope, curvature, near = _shape(z, around)
        reach = xp.sqrt(near) / 2
        newton = slope / xp.where(curvature < 0, -curvature, 1)
        uphill = xp.where(curvature < 0, newton, xp.where(slope > 0, 1, -1) * reach)
        turn = xp.minimum(xp.maximum(uphill, -reach), reach)
        half = turn / 2
        shrink = 1 / (1 + half * half)
        z = z * to_complex((1 - half * half) * shrink, turn * shrink)
        return (abs(turn), z, *around)

    infinite = xp.full(start.shape, np.inf, dtype=size.dtype)
    state = repeat(
        step,
        (infinite, at, *poles),
        times=_STEPS,
        done=lambda state: ~(state[0] > tolerance),
    )
    return state[1]


def _shape(z: Array, poles: Sequence[Array]) -> tuple[Array, Array, Array]:
    """Return slope and curvature of log h in the angle, and the nearest pole's squared distance."""
    xp = namespace(z)
    slope = curvature = 0
    near = None
    for pole in poles:
        apart = z - pole
        distance = xp.maximum(squared(apart), float(np.finfo(apart.real.dtype).tiny) * 4)
        ratio = z * (apart.conj() * (1 / distance))  # z / (z - p)
        slope = slope + 2 * ratio.imag
        # d/dphi z / (z - p) = -i z p / (z - p)^2 and p / (z - p) = z / (z - p) - 1
        curvature = curvature - 2 * (ratio * (ratio - 1)).real
        near = distance if near is None else xp.minimum(near, distance)
    return slope, curvature, near


def _modulus(z: Array, poles: Sequence[Array]) -> Array:
    """Return prod |z - p_l|^2, the denominator of Eq. (2)."""
    product = squared(z - poles[0])
    for pole in poles[1:]:
        product = product * squared(z - pole)
    return product


def _is_peak(z: Array, poles: Sequence[Array]) -> Array:
    """Say where log h is curved like a maximum by more than rounding."""
    return _shape(z, poles)[1] < -(float(np.finfo(z.real.dtype).eps) ** 0.5)
