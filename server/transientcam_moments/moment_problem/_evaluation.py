"""Eq. (2) for polynomials a = (1, a_1 .. a_m) at phases that share the sums over harmonics.

Banks ``u`` and ``v`` hold what `turned` makes of a_1 .. a_m, ``c`` and ``s`` cos and sin of j times
the phase, or its distance from the phase that they are turned to. ``scale`` is E / (2 pi) and
``least`` the smallest squared modulus above rounding.
"""

from transientcam_moments.arrays import Bank, Length, Pair, Plane, larger

Sums = tuple[Plane, Plane, Plane, Plane]


def height(scale: Plane, least: Plane, x: Plane, y: Plane) -> Plane:
    """Return the density where sum_j conj(a_j) exp(i j phi) is x + i y."""
    return scale / larger(x * x + y * y, least)


def turned(re: Plane, im: Plane, c: Plane, s: Plane) -> Pair:
    """Return conj(a_j) exp(i j phi) for cos and sin of j phi."""
    return re * c + im * s, re * s - im * c


def any_two(
    order: Length,
    scale: Plane,
    least: Plane,
    re: Bank,
    im: Bank,
    c0: Bank,
    s0: Bank,
    c1: Bank,
    s1: Bank,
) -> Pair:
    """Evaluate Eq. (2) at two phases, for a_1 .. a_m as they are."""
    x0, y0 = 1.0 + re[0] * c0[0] + im[0] * s0[0], re[0] * s0[0] - im[0] * c0[0]
    x1, y1 = 1.0 + re[0] * c1[0] + im[0] * s1[0], re[0] * s1[0] - im[0] * c1[0]
    for j in range(1, len(order)):
        x0, y0 = x0 + re[j] * c0[j] + im[j] * s0[j], y0 + re[j] * s0[j] - im[j] * c0[j]
        x1, y1 = x1 + re[j] * c1[j] + im[j] * s1[j], y1 + re[j] * s1[j] - im[j] * c1[j]
    return height(scale, least, x0, y0), height(scale, least, x1, y1)


def _sums(
    order: Length,
    uc: Plane,
    zero: Plane,
    u: Bank,
    v: Bank,
    c: Bank,
    s: Bank,
    first: int,
    every: int,
) -> Sums:
    """Sum u c, v s, u s and v c of every so many j; ``uc`` is what to add to."""
    vs = us = vc = zero
    for j in range(first, len(order), every):
        uc, vs, us, vc = uc + u[j] * c[j], vs + v[j] * s[j], us + u[j] * s[j], vc + v[j] * c[j]
    return uc, vs, us, vc


def mirrored_two(
    order: Length, one: Plane, scale: Plane, least: Plane, u: Bank, v: Bank, c: Bank, s: Bank
) -> Pair:
    """Evaluate Eq. (2) at two phases as far before as behind the one to which a is turned.

    With conj(a_j) turned to u + i v it is sum_j (u c - v s) + i (u s + v c), and s changes sign:
    the same four sums serve both.
    """
    uc, vs, us, vc = _sums(order, one, 0.0 * one, u, v, c, s, 0, 1)
    return height(scale, least, uc - vs, vc + us), height(scale, least, uc + vs, vc - us)


def four_of_a_turn(
    order: Length, one: Plane, scale: Plane, least: Plane, u: Bank, v: Bank, c: Bank, s: Bank
) -> Sums:
    """Evaluate Eq. (2) at the two phases of `mirrored_two` and half a turn from each of them.

    There the terms of odd j change sign: the same eight sums serve all four.
    """
    uc, vs, us, vc = _sums(order, one, 0.0 * one, u, v, c, s, 1, 2)  # j = 2, 4, ...
    x0, y0, x1, y1 = uc - vs, vc + us, uc + vs, vc - us
    uc, vs, us, vc = _sums(order, 0.0 * one, 0.0 * one, u, v, c, s, 0, 2)  # j = 1, 3, ...
    dx0, dy0, dx1, dy1 = uc - vs, vc + us, uc + vs, vc - us
    return (
        height(scale, least, x0 + dx0, y0 + dy0),
        height(scale, least, x1 + dx1, y1 + dy1),
        height(scale, least, x0 - dx0, y0 - dy0),
        height(scale, least, x1 - dx1, y1 - dy1),
    )
