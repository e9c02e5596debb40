"""Roots of many small polynomials at once, by simultaneous iteration after Ehrlich and Aberth."""

from collections.abc import Sequence

import numpy as np

from transientcam_moments.arrays import Array, namespace, repeat, squared, to_complex

_STEPS = 80  # ten are usual; clusters need more


def circle_roots(a: Sequence[Array], count: Array, last: Array) -> list[Array]:
    """Find the roots of 1 + a_1 u + ... + a_count u^count, all of them on the unit circle.

    Parameters
    ----------
    a : sequence of m complex planes
        a_1 .. a_m of predictor polynomials that end in a reflection coefficient of modulus 1;
        a_j = 0 for j > count.
    count : integer plane
        The degree of each pixel's polynomial, 0 to m.
    last : complex plane
        a_count, of modulus 1.

    Returns
    -------
    list of m complex planes
        Of modulus 1; those from number `count` on mean nothing.

    Notes
    -----
    On the circle such a polynomial is a phase factor times a real function of the angle psi, all
    of whose zeros are real and simple. The iteration is Newton's on that function, with the other
    roots divided out; an angle is changed by a Cayley rotation, which cannot leave the circle.
    The starts are the roots of 1 + last u^count, exact for a uniform density.
    """
    xp = namespace(last)
    degree = len(a)
    starts, actives = _spread(last, count, degree)

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        roots, poly = state[2 : degree + 2], state[degree + 2 : 2 * degree + 2]
        active = state[2 * degree + 2 :]
        repulsion = _repulsion(roots, active)
        largest = xp.zeros_like(state[0])
        moved = []
        for root, others, present in zip(roots, repulsion, active, strict=True):
            value, slope = _horner(poly, root)
            # Newton's step w = A / (A' - A sum 1/(u - u_j)); the turn is the part of -w / u along
            # the circle, and what rounding puts across it is left out
            below = root * (slope - value * others)
            size = squared(below)
            turn = (below * value.conj()).imag * xp.where(size == 0, 0, 1 / size) * present
            half = turn / 2
            shrink = 1 / (1 + half * half)
            moved.append(root * to_complex((1 - half * half) * shrink, turn * shrink))
            largest = xp.maximum(largest, abs(turn))
        return (largest, state[0], *moved, *poly, *active)

    infinite = xp.full(last.shape, np.inf, dtype=actives[0].dtype)
    start = (infinite, infinite, *starts, *a, *actives)
    state = repeat(step, start, times=_STEPS, done=_settled)
    return list(state[2 : degree + 2])


def disc_roots(a: Sequence[Array]) -> list[Array]:
    """Find the roots of z^m + a_1 z^{m-1} + ... + a_m: the poles of a maximum entropy density.

    Parameters
    ----------
    a : sequence of m complex planes
        a_1 .. a_m of predictor polynomials; all roots lie inside the unit circle.

    Returns
    -------
    list of m complex planes
    """
    xp = namespace(a[0])
    degree = len(a)
    one = xp.ones_like(a[0])
    if degree == 1:
        return [-a[0]]
    largest = squared(a[0])
    for plane in a[1:]:
        largest = xp.maximum(largest, squared(plane))
    # no root is farther out than 2 max |a_j|^(1/j); a start on a circle of about the right size
    radius = xp.minimum(xp.sqrt(largest), 0.9) + 0.05
    angle = 2 * np.pi * np.arange(degree) / degree + 0.4
    starts = [radius * one * complex(np.exp(1j * x)) for x in angle]

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        roots, poly = state[2 : degree + 2], state[degree + 2 :]
        repulsion = _repulsion(roots, None)
        furthest = xp.zeros_like(state[0])
        moved = []
        for root, others in zip(roots, repulsion, strict=True):
            value, slope = _horner_monic(poly, root)
            # Newton's w = p / p', corrected: w / (1 - w sum) = p / (p' - p sum)
            below = slope - value * others
            size = squared(below)
            change = value * below.conj() * xp.where(size == 0, 0, 1 / size).astype(size.dtype)
            moved.append(root - change)
            furthest = xp.maximum(furthest, squared(change))
        return (xp.sqrt(furthest), state[0], *moved, *poly)

    infinite = xp.full(a[0].shape, np.inf, dtype=radius.dtype)
    start = (infinite, infinite, *starts, *a)
    return list(repeat(step, start, times=_STEPS, done=_settled)[2 : degree + 2])


def _settled(state: tuple[Array, ...]) -> Array:
    """Say where the last step was rounding: tiny, or small and no longer shrinking.

    Close roots are known to eps over their distance only, and steps of that size go on for ever.
    """
    last, before = state[:2]
    eps = float(np.finfo(last.dtype).eps)
    return ~(last > 4 * eps) | ((last < eps ** (2 / 3)) & (last > before / 4))


def _spread(last: Array, count: Array, degree: int) -> tuple[list[Array], list[Array]]:
    """Return the roots of 1 + last u^count and which of them there are."""
    xp = namespace(last)
    orders = np.maximum(np.arange(degree + 1), 1)
    turns = xp.asarray(np.exp(2j * np.pi / orders)).astype(last.dtype)[count]
    angle = xp.arctan2(-last.imag, -last.real) / xp.maximum(count, 1).astype(last.real.dtype)
    root = to_complex(xp.cos(angle), -xp.sin(angle))  # u^count = -1 / last, |last| = 1
    roots = [root]
    for _ in range(degree - 1):
        roots.append(roots[-1] * turns)
    return roots, [(count > index).astype(last.real.dtype) for index in range(degree)]


def _repulsion(roots: Sequence[Array], active: Sequence[Array] | None) -> list[Array]:
    """Return sum_{j != i} 1 / (u_i - u_j) for every root."""
    xp = namespace(roots[0])
    tiny = float(np.finfo(roots[0].real.dtype).tiny)
    sums = [xp.zeros_like(root) for root in roots]
    for i in range(len(roots)):
        for j in range(i):
            apart = roots[i] - roots[j]
            inverse = 1 / (squared(apart) + tiny)  # roots that coincide don't repel each other
            if active is not None:
                inverse = inverse * active[i]  # present ones come first, so that i > j decides
            away = apart.conj() * inverse
            sums[i] = sums[i] + away
            sums[j] = sums[j] - away
    return sums


def _horner(a: Sequence[Array], u: Array) -> tuple[Array, Array]:
    """Return A(u) = 1 + a_1 u + ... + a_m u^m and A'(u)."""
    value = a[-1]
    slope = 0 * value
    for plane in reversed(a[:-1]):
        slope = slope * u + value
        value = value * u + plane
    return value * u + 1, slope * u + value


def _horner_monic(a: Sequence[Array], z: Array) -> tuple[Array, Array]:
    """Return p(z) = z^m + a_1 z^{m-1} + ... + a_m and p'(z)."""
    value = z + a[0]
    slope = 0 * z + 1
    for plane in a[1:]:
        slope = slope * z + value
        value = value * z + plane
    return value, slope
