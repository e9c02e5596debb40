"""Roots of real trigonometric polynomials on the unit circle, a register of pixels at a time.

Half angles: a point of the unit circle z = exp(i phi) is kept as omega = exp(i phi / 2), with which
all that is needed of a polynomial there is real.
"""

from typing import Any

import numpy as np
from numba import njit

from transientcam_moments._kernels import simd


@njit(forceinline=True, error_model="numpy")
def circle_roots(
    order: Any, ar: Any, ai: Any, turns: Any, hr: Any, hi: Any, wr: Any, wi: Any, move: Any,
    steps: int,
) -> None:  # fmt: skip
    """Fill ``wr``, ``wi`` with the half angles of the m roots of sum_j conj(a_j) exp(i j phi).

    On the circle the polynomial is a phase factor times the real Q(phi), since |a_m| = 1. Newton's
    iteration on Q with the other roots divided out (Ehrlich, Aberth), as rotations: if the other
    roots are exact, cot of half the error is 2 Q' / Q - sum_k cot((phi - phi_k) / 2), and one step
    arrives. ``turns`` holds cos and sin of pi k / m. At most ``steps`` are done.
    """
    m = len(order)
    gr, gi = ar[m], ai[m]
    # eta^2 ~ conj(g_m), so that conj(eta) z^(-m/2) sum_j conj(a_j) z^j is real
    er = simd.select(gr >= 0.0, 1.0 + gr, -gi)
    ei = simd.select(gr >= 0.0, -gi, 1.0 - gr)
    terms = m - m // 2
    first = m // 2 + 1
    for t in range(terms):
        cr, ci = ar[first + t], ai[first + t]
        hr[t], hi[t] = 2.0 * (cr * er - ci * ei), -2.0 * (ci * er + cr * ei)
    middle = er * 0.0
    if m % 2 == 0:
        middle = ar[m // 2] * er - ai[m // 2] * ei
    # the roots of 1 + conj(g_m) z^m, exact for a uniform density
    x, y = -gr, -gi
    ax, ay = simd.absolute(x), simd.absolute(y)
    tangent = simd.minimum(ax, ay) / (1.0 + simd.maximum(ax, ay))
    angle = 2.0 * tangent * simd.arctangent_ratio(tangent * tangent)
    angle = simd.select(ay > ax, 0.5 * np.pi - angle, angle)
    angle = simd.select(x < 0.0, np.pi - angle, angle)
    angle = simd.select(y < 0.0, -angle, angle) * (0.5 / m)
    square = angle * angle
    c = 1.0 - square * (0.5 - square / 24.0)
    s = angle * (1.0 - square * (1.0 - square / 20.0) / 6.0)
    size = 1.0 / simd.sqrt(c * c + s * s)
    c, s = c * size, s * size
    for k in range(m):
        wr[k], wi[k] = c * turns[k] - s * turns[m + k], c * turns[m + k] + s * turns[k]
    near = simd.nearly(middle)
    moving = middle == middle
    for step in range(steps):
        for i in range(m):
            move[i] = middle * 0.0
        for i in range(m if step > 0 else 0):  # equidistant at first: the sums are 0
            for k in range(i):
                cosine = wr[i] * wr[k] + wi[i] * wi[k]
                sine = wi[i] * wr[k] - wr[i] * wi[k]
                cotangent = cosine / (sine + simd.tiny(sine))
                move[i] = move[i] + cotangent
                move[k] = move[k] - cotangent
        largest = middle * 0.0
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
            below = -2.0 * (sr * ui + si * ur) - value * move[i]
            size = 1.0 / simd.sqrt(below * below + value * value + simd.tiny(value))
            # a pixel that has arrived stays, however long its neighbours take
            c = simd.select(moving, below * size, 1.0)
            s = simd.select(moving, -value * size, 0.0)
            wr[i], wi[i] = x * c - y * s, x * s + y * c
            largest = simd.maximum(simd.absolute(s), largest)
        moving = moving & (largest > near)
        if not simd.some(moving):
            break


def half_turns(m: int, precision: str) -> Any:
    """Return cos and sin of pi k / m, k < m, one after the other."""
    angle = np.pi * np.arange(m) / m
    return np.concatenate([np.cos(angle), np.sin(angle)]).astype(precision)
