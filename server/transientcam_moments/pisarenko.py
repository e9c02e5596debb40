"""Pisarenko's estimate: a uniform part and at most m sharp returns (Sec. 5.1, Theorem 2)."""

from typing import NamedTuple

import numpy as np

from transientcam_moments import _kernels
from transientcam_moments._arrays import (
    Array,
    below_one,
    by_blocks,
    in_range,
    moment_planes,
    namespace,
    squared,
)
from transientcam_moments.biasing import search
from transientcam_moments.levinson import normalised
from transientcam_moments.roots import circle_roots

DIRECT_THRESHOLD = 0.1
"""A return is the direct one when it is the first with this share of the strongest."""


class Returns(NamedTuple):
    """Sharp returns and a uniform part with the moments of the measurement.

    Attributes
    ----------
    phase_rad : array, shape (m, ...)
        In [0, 2 pi), ascending; NaN in unused slots, which come last.
    weight : array, shape (m, ...)
        Brightness of each return, >= 0; 0 in unused slots.
    uniform : array, shape (...)
        The smallest eigenvalue, brightness of the uniform part; negative where the moments
        contradict each other. The weights and it add up to b_0.
    count : integer array, shape (...)
        Number of returns.
    """

    phase_rad: Array
    weight: Array
    uniform: Array
    count: Array


class Separation(NamedTuple):
    """Direct and indirect light of each pixel (Sec. 5.1).

    Attributes
    ----------
    direct : array, shape (...)
        Weight of the direct return; 0 where there is none.
    indirect : array, shape (...)
        Sum of the other weights.
    phase_rad : array, shape (...)
        Phase of the direct return; NaN where there is none.
    """

    direct: Array
    indirect: Array
    phase_rad: Array


def pisarenko(b: Array) -> Returns:
    """Explain moments by a uniform part and as few returns as there have to be.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments; with b_0 = 0 where it was not measured, the returns are those of
        least total brightness.

    Returns
    -------
    result : `Returns`
        Fewer than m returns where the smallest eigenvalue is multiple; none where there is no
        light or a moment is NaN or infinite.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers.

    Notes
    -----
    Theorem 2. At the smallest eigenvalue lambda Levinson's recursion on B - lambda I ends with an
    error of zero at the order of the smallest singular leading block, which is the number of
    returns; its polynomial is the eigenvector. The weights are 1 / sum_k |Phi_k(z)|^2 / E_k with
    the recursion's polynomials Phi_k, and so never negative.
    """
    planes, trailing = moment_planes(b)
    run = _kernels.find("pisarenko", planes) or _pisarenko
    phase, weight, uniform, count = by_blocks(run, planes) if run is _pisarenko else run(planes)
    return Returns(
        phase.reshape((-1, *trailing)),
        weight.reshape((-1, *trailing)),
        uniform.reshape(trailing),
        count.reshape(trailing),
    )


def separate(returns: Returns, threshold: float = DIRECT_THRESHOLD) -> Separation:
    """Tell direct from indirect light.

    Parameters
    ----------
    returns : Returns
        From `pisarenko`.
    threshold : float
        The direct return is the first whose weight is at least this share of the strongest one's,
        0 to 1.

    Returns
    -------
    Separation

    Raises
    ------
    ParameterError
        For a threshold outside of 0 to 1.

    Notes
    -----
    Sec. 5.1: "the first return with a weight above a relative threshold".
    """
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    xp = namespace(returns.weight)
    weights = returns.weight
    enough = threshold * weights.max(axis=0)
    direct = xp.zeros_like(weights[0])
    phase = xp.full(weights[0].shape, np.nan, dtype=weights.dtype)
    for weight, angle in zip(weights[::-1], returns.phase_rad[::-1], strict=True):
        first = (weight >= enough) & (weight > 0)
        direct = xp.where(first, weight, direct)
        phase = xp.where(first, angle, phase)
    return Separation(direct, xp.maximum(weights.sum(axis=0) - direct, 0), phase)


def _pisarenko(b: Array) -> tuple[Array, Array, Array, Array]:
    """Planar statement of `pisarenko`: b (m + 1, P) to phase, weight, uniform, count."""
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        planes, scale = normalised(b)
        uniform = search(planes)
        phase, weight, count = _returns(planes, uniform)
        return phase, weight * scale, uniform * scale, count


def _returns(b: list[Array], uniform: Array) -> tuple[Array, Array, Array]:
    """Find the returns of planes whose largest moment is 1, with a singular B - uniform I."""
    xp = namespace(b[1])
    total = b[0] - uniform
    inverse = xp.where(total > 0, 1 / total, 0.0).astype(total.dtype)
    errors, a, reflection, count, last = _singular([p * inverse for p in b[1:]], total > 0)
    roots = circle_roots(a, count, last)
    noise = 4 * len(a) * float(np.finfo(total.dtype).eps)
    phases, weights = [], []
    for index, u in enumerate(roots):
        angle = xp.arctan2(-u.imag, u.real)  # z = 1 / u
        angle = xp.where(angle < 0, angle + 2 * np.pi, angle)
        angle = xp.where(angle >= np.asarray(2 * np.pi, angle.dtype), 0, angle)
        weight = 1 / _christoffel(errors, reflection, count, u)
        used = (count > index) & (weight > noise)
        phases.append(xp.where(used, angle, np.nan).astype(total.dtype))
        weights.append(xp.where(used, weight * total, 0).astype(total.dtype))
    phase, weight = xp.stack(phases), xp.stack(weights)
    count = (weight > 0).sum(axis=0).astype(np.int32)
    order = xp.argsort(phase, axis=0)  # NaN comes last
    return (
        xp.take_along_axis(phase, order, axis=0),
        xp.take_along_axis(weight, order, axis=0),
        count,
    )


def _singular(
    b: list[Array], lit: Array
) -> tuple[list[Array], list[Array], list[Array], Array, Array]:
    """Run Levinson's recursion (b_0 = 1) up to the smallest singular leading block.

    Returns
    -------
    errors : list of m real planes
        E_0 .. E_{m-1}.
    a : list of m complex planes
        a_1 .. a_m of the singular block's polynomial, zero beyond its order.
    reflection : list of m complex planes
        g_1 .. g_m, the last one that is not zero of modulus 1.
    count : integer plane
        Order of the singular block; 0 where there is no light.
    last : complex plane
        The reflection coefficient of modulus 1.
    """
    xp = namespace(b[0])
    m = len(b)
    one = xp.ones_like(b[0].real)
    floor = 4 * m * float(np.finfo(one.dtype).eps)
    alive = lit
    error = one
    errors: list[Array] = []
    a: list[Array] = []
    reflection: list[Array] = []
    count = xp.zeros(one.shape, dtype=np.int32)
    last = xp.ones_like(b[0])
    for k in range(1, m + 1):
        errors.append(error)
        inner = b[k - 1]
        for j in range(1, k):
            inner = inner + a[j - 1] * b[k - j - 1]
        g = inner * xp.where(alive, -1 / error, 0).astype(one.dtype)
        size = squared(g)
        remaining = error * below_one(g)
        ends = alive if k == m else alive & ~(remaining > floor)
        unit = g * xp.where(size > 0, 1 / xp.sqrt(size), 0).astype(one.dtype)
        unit = xp.where(size > 0, unit, xp.ones_like(unit))
        g = xp.where(ends, unit, g)
        last = xp.where(ends, unit, last)
        count = xp.where(ends, k, count)
        a = [a[j - 1] + g * a[k - j - 1].conj() for j in range(1, k)] + [g]
        reflection.append(g)
        alive = alive & ~ends
        error = xp.where(alive, remaining, error)
    return errors, a, reflection, count.astype(np.int32), last


def _christoffel(errors: list[Array], reflection: list[Array], count: Array, u: Array) -> Array:
    """Return s* T^-1 s = sum_{k < count} |Phi_k(z)|^2 / E_k at z = 1 / u on the unit circle.

    On the circle |Phi_k(z)| = |A_k(u)| for the predictor polynomial A_k, which goes up with its
    reversed B_k(u) = u^k conj(A_k): A_k = A_{k-1} + g_k u B_{k-1}, u B_k = u (u B_{k-1} +
    conj(g_k) A_{k-1}).
    """
    xp = namespace(u)
    forward = xp.ones_like(u)
    backward = u
    total = squared(forward) / errors[0]
    for k in range(1, len(errors)):
        g = reflection[k - 1]
        forward, backward = forward + g * backward, u * (backward + g.conj() * forward)
        total = total + xp.where(count > k, squared(forward) / errors[k], 0)
    return total
