"""Sharp returns at the roots of a polynomial on the unit circle (Sec. 5.1, Theorem 2).

Half angles: a point of the unit circle z = exp(i phi) is kept as omega = exp(i phi / 2), with which
all that is needed of a polynomial there is real.
"""

import numpy as np
from numpy.typing import DTypeLike

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    Mask,
    Pair,
    Plane,
    arctangent_ratio,
    bank,
    larger,
    magnitude,
    repeat,
    root,
    root_eps,
    select,
    smaller,
    tiny,
)


def _signed_angle(x: Plane, y: Plane) -> Plane:
    """Return the angle of a point, but for the sign of y, from 0 to pi."""
    ax, ay = magnitude(x), magnitude(y)
    t = smaller(ax, ay) / (1.0 + larger(ax, ay))  # tan of half the angle to an axis
    angle = 2.0 * t * arctangent_ratio(t * t)
    angle = select(ay > ax, 0.5 * np.pi - angle, angle)
    return select(x < 0.0, np.pi - angle, angle)


def phase_of(x: Plane, y: Plane) -> Plane:
    """Return the angle of a point of the unit circle, in [0, 2 pi)."""
    angle = _signed_angle(x, y)
    angle = select(y < 0.0, 2.0 * np.pi - angle, angle)
    return select(angle >= 2.0 * np.pi, 0.0, angle)


def circle_roots(
    order: Length, turns: Array, steps: int, ar: Bank, ai: Bank
) -> tuple[Mask, Array, Array]:
    """Return the half angles of the m roots of sum_j conj(a_j) exp(i j phi), all on the circle.

    On the circle the polynomial is a phase factor times a real Q(phi), since |a_m| = 1, all of
    whose zeros are real. Newton's iteration on Q with the other roots divided out (Ehrlich,
    Aberth), as rotations, which cannot leave the circle: if the other roots are exact, cot of half
    the error is 2 Q' / Q - sum_k cot((phi - phi_k) / 2), and one step arrives. ``turns`` is from
    `half_turns`. At most ``steps`` are done; the mask says where that wasn't enough.
    """
    m = len(order)
    gr, gi = ar[m], ai[m]
    # eta^2 ~ conj(g_m), so that conj(eta) z^(-m/2) sum_j conj(a_j) z^j is real
    er, ei = select(gr >= 0.0, 1.0 + gr, -gi), select(gr >= 0.0, -gi, 1.0 - gr)
    hr, hi = bank(gr, order, 0), bank(gr, order, 0)
    for t in range(m - m // 2):
        cr, ci = ar[m // 2 + 1 + t], ai[m // 2 + 1 + t]
        hr[t], hi[t] = 2.0 * (cr * er - ci * ei), -2.0 * (ci * er + cr * ei)
    middle = er * 0.0
    if m % 2 == 0:
        middle = ar[m // 2] * er - ai[m // 2] * ei
    # the roots of 1 + conj(g_m) z^m, exact for a uniform density
    angle = _signed_angle(-gr, -gi)
    angle = select(-gi < 0.0, -angle, angle) * (0.5 / m)
    square = angle * angle
    c = 1.0 - square * (0.5 - square / 24.0)
    s = angle * (1.0 - square * (1.0 - square / 20.0) / 6.0)
    size = 1.0 / root(c * c + s * s)
    c, s = c * size, s * size
    wr, wi = bank(gr, order, 0), bank(gr, order, 0)
    for k in range(m):
        wr[k], wi[k] = c * turns[k] - s * turns[m + k], c * turns[m + k] + s * turns[k]
    state = middle <= middle, wr, wi  # NaN does not move
    moving, wr, wi = repeat(turn_roots, steps, (order,), (middle, hr, hi), state)
    return moving, wr, wi


def turn_roots(
    first: bool,
    fixed: tuple[Length],
    given: tuple[Plane, Bank, Bank],
    state: tuple[Mask, Bank, Bank],
) -> tuple[Mask, Bank, Bank]:
    """Take a step of `circle_roots`; equidistant roots, which the first one finds, repel nothing.

    ``given`` holds Q's constant term, which even orders have, and its coefficients.
    """
    order = fixed[0]
    middle, hr, hi = given
    moving, wr, wi = state
    m = len(order)
    terms = m - m // 2
    repulsion = bank(middle, order, 0)
    for i in range(m):
        repulsion[i] = middle * 0.0
    for i in range(0 if first else m):
        for k in range(i):
            cosine = wr[i] * wr[k] + wi[i] * wi[k]
            sine = wi[i] * wr[k] - wr[i] * wi[k]
            cotangent = cosine / (sine + tiny(sine))
            repulsion[i] = repulsion[i] + cotangent
            repulsion[k] = repulsion[k] - cotangent
    furthest = middle * 0.0
    for i in range(m):
        x, y = wr[i], wi[i]
        zr, zi = x * x - y * y, 2.0 * x * y
        ur, ui = x, y
        if m % 2 == 0:
            ur, ui = zr, zi
        # v = sum_t h_t z^t and s = sum_t (t + 1) h_t z^t (Horner; s_t = v_t + z s_{t+1})
        vr, vi = hr[terms - 1], hi[terms - 1]
        sr, si = vr, vi
        for t in range(terms - 2, -1, -1):
            tr, ti = vr * zr - vi * zi, vr * zi + vi * zr
            vr, vi = hr[t] + tr, hi[t] + ti
            if t < terms - 2:
                tr, ti = sr * zr - si * zi, sr * zi + si * zr
            sr, si = vr + tr, vi + ti
        if m % 2 == 1:
            sr, si = sr - 0.5 * vr, si - 0.5 * vi
        value = middle + vr * ur - vi * ui
        below = -2.0 * (sr * ui + si * ur) - value * repulsion[i]
        size = 1.0 / root(below * below + value * value + tiny(value))
        # a pixel that has arrived stays, however long its neighbours take
        c, s = select(moving, below * size, 1.0), select(moving, -value * size, 0.0)
        wr[i], wi[i] = x * c - y * s, x * s + y * c
        furthest = larger(magnitude(s), furthest)
    return moving & (furthest > root_eps(furthest)), wr, wi


def weigh(
    order: Length, gr: Bank, gi: Bank, inverse: Bank, x: Plane, y: Plane
) -> tuple[Plane, Plane, Plane]:
    """Return the weight of a return at a half angle, and that half angle corrected.

    w = 1 / sum_k |Phi_k(z)|^2 / E_k, k < m, of b_0 = 1, is never negative; reflection coefficients
    and 1 / E_k are from `toeplitz.singular`. With S_k = z^(-k/2) Phi_k the recursion is
    t = conj(omega) S, S = t + conj(g t), and the argument of t turns with phi at the rate that the
    same sum says (Christoffel, Darboux), which is Newton's step for free.
    """
    m = len(order)
    sr, si = x * 0.0 + 1.0, y * 0.0
    total = inverse[0]
    for k in range(1, m):
        tr, ti = x * sr + y * si, x * si - y * sr
        sr = tr + gr[k - 1] * tr - gi[k - 1] * ti
        si = ti - gr[k - 1] * ti - gi[k - 1] * tr
        total = total + (sr * sr + si * si) * inverse[k]
    tr, ti = x * sr + y * si, x * si - y * sr
    a, b = gr[m - 1], gi[m - 1]
    er, ei = select(a >= 0.0, 1.0 + a, -b), select(a >= 0.0, -b, 1.0 - a)
    real, imag = er * tr + ei * ti, er * ti - ei * tr  # conj(eta) t, imaginary at a root
    w = 1.0 / total
    turn = -(real / imag) * (tr * tr + ti * ti) * inverse[m - 1] * w
    return w, x - y * turn, y + x * turn


def doubled(x: Plane, y: Plane) -> Pair:
    """Return the point of the unit circle whose half angle is given."""
    return x * x - y * y, 2.0 * x * y


def half_turns(m: int, precision: DTypeLike) -> Array:
    """Return cos and sin of pi k / m, k < m, one after the other."""
    angle = np.pi * np.arange(m) / m
    return np.concatenate([np.cos(angle), np.sin(angle)]).astype(precision)
