"""Pisarenko's returns for one register of pixels at a time, expanded into the kernels.

``order`` is a tuple of length m; banks of registers are taken and filled. Half angles: a point of
the unit circle z = exp(i phi) is kept as omega = exp(i phi / 2), with which all that is needed of
a polynomial there is real.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_moments._kernels import simd, toeplitz
from transientcam_moments._kernels.compiled_entry import (
    COUNTS,
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)

_INTERLEAVE = 2
_FAINT = 1024.0  # times what rounding makes of nothing
_ROOT_STEPS = 24  # four are usual


@njit(forceinline=True, error_model="numpy")
def phase_of(x: Any, y: Any) -> Any:
    """Return the angle of a point of the unit circle, in [0, 2 pi)."""
    ax, ay = simd.absolute(x), simd.absolute(y)
    t = simd.minimum(ax, ay) / (1.0 + simd.maximum(ax, ay))  # tan of half the angle to an axis
    angle = 2.0 * t * simd.arctangent_ratio(t * t)
    angle = simd.select(ay > ax, 0.5 * np.pi - angle, angle)
    angle = simd.select(x < 0.0, np.pi - angle, angle)
    angle = simd.select(y < 0.0, 2.0 * np.pi - angle, angle)
    return simd.select(angle >= 2.0 * np.pi, 0.0, angle)


@njit(forceinline=True, error_model="numpy")
def singular(
    order: Any, re: Any, im: Any, ar: Any, ai: Any, gr: Any, gi: Any, inverse: Any, floor: Any
) -> Any:
    """Run Levinson's recursion on a singular matrix with b_0 = 1, up to |g_m| = 1 (Theorem 2).

    Fills the eigenvector a, g_1 .. g_m and 1 / E_0 .. 1 / E_{m-1}; returns where a smaller block is
    singular already, but for ``floor``.
    """
    m = len(order)
    error = re[0]
    fewer = error < error
    for k in range(1, m + 1):
        inverse[k - 1] = 1.0 / error
        x, y = toeplitz.reflect(k, re, im, ar, ai, error)
        if k < m:
            error = error * toeplitz.below_one(x, y)
            fewer = fewer | ~(error > floor)
        else:  # E_m = 0: a is the eigenvector of the smallest eigenvalue (Sec. 5.1)
            unit = 1.0 / simd.sqrt(x * x + y * y)
            x, y = x * unit, y * unit
        toeplitz.step_up(k, ar, ai, x, y)
        gr[k - 1], gi[k - 1] = x, y
    return fewer


@njit(forceinline=True, error_model="numpy")
def circle_roots(
    order: Any, ar: Any, ai: Any, turns: Any, hr: Any, hi: Any, wr: Any, wi: Any, move: Any
) -> None:
    """Fill ``wr``, ``wi`` with the half angles of the m roots of sum_j conj(a_j) exp(i j phi).

    On the circle the polynomial is a phase factor times the real Q(phi), since |a_m| = 1. Newton's
    iteration on Q with the other roots divided out (Ehrlich, Aberth), as rotations: if the other
    roots are exact, cot of half the error is 2 Q' / Q - sum_k cot((phi - phi_k) / 2), and one step
    arrives. ``turns`` holds cos and sin of pi k / m.
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
    for _ in range(_ROOT_STEPS):
        for i in range(m):
            move[i] = middle * 0.0
        for i in range(m):
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
            vr, vi = hr[terms - 1], hi[terms - 1]
            sr, si = vr * m, vi * m
            for t in range(terms - 2, -1, -1):
                vr, vi = hr[t] + vr * zr - vi * zi, hi[t] + vr * zi + vi * zr
                factor = 2 * t + 2 - m % 2
                sr, si = hr[t] * factor + sr * zr - si * zi, hi[t] * factor + sr * zi + si * zr
            value = middle + vr * ur - vi * ui
            below = -(sr * ui + si * ur) - value * move[i]
            size = 1.0 / simd.sqrt(below * below + value * value + simd.tiny(value))
            # a pixel that has arrived stays, however long its neighbours take
            c = simd.select(moving, below * size, 1.0)
            s = simd.select(moving, -value * size, 0.0)
            wr[i], wi[i] = x * c - y * s, x * s + y * c
            largest = simd.maximum(simd.absolute(s), largest)
        moving = moving & (largest > near)
        if not simd.some(moving):
            break


@njit(forceinline=True, error_model="numpy")
def weigh(order: Any, gr: Any, gi: Any, inverse: Any, x: Any, y: Any) -> Any:
    """Return the weight of a return at a half angle, and that half angle corrected.

    w = 1 / sum_k |Phi_k(z)|^2 / E_k, k < m. With S_k = z^(-k/2) Phi_k the
    recursion is t = conj(omega) S, S = t + conj(g t), and the argument of t turns with phi at the
    rate that the same sum says (Christoffel, Darboux), which is Newton's step for free.
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
    er, ei = simd.select(a >= 0.0, 1.0 + a, -b), simd.select(a >= 0.0, -b, 1.0 - a)
    real, imag = er * tr + ei * ti, er * ti - ei * tr  # conj(eta) t, imaginary at a root
    turn = -(real / imag) * (tr * tr + ti * ti) * inverse[m - 1] / total
    return 1.0 / total, x - y * turn, y + x * turn


@njit(nogil=True, error_model="numpy")
def find_returns(
    order: Any,
    turns: Any,
    b: Any,
    zeroth: Any,
    apart: bool,
    uniform: Any,
    phase: Any,
    weight: Any,
    count: Any,
    residual: Any,
    noise: float,
    start: int,
    stop: int,
) -> int:
    """Write the returns of the pixels start..stop, whose smallest eigenvalues are known.

    b_0 comes from ``zeroth`` if it is ``apart``.

    ``noise`` is the precision of the data. ``residual`` becomes the error of all moments that
    the returns leave, relative to their sum; infinite where they could not be found, 0 where there
    is no light. Returns how many pixels have one larger than rounding explains.
    """
    m = len(order)
    one = simd.ones(uniform, _INTERLEAVE)
    step = simd.width(one)
    re, im = simd.registers(one, order, 1), simd.registers(one, order, 1)
    ar, ai = simd.registers(one, order, 1), simd.registers(one, order, 1)
    gr, gi = simd.registers(one, order, 0), simd.registers(one, order, 0)
    hr, hi = simd.registers(one, order, 1), simd.registers(one, order, 1)
    wr, wi = simd.registers(one, order, 0), simd.registers(one, order, 0)
    inverse, move = simd.registers(one, order, 0), simd.registers(one, order, 0)
    floor = simd.spread(one, 4.0 * m * noise)
    tolerance = simd.spread(one, 16.0 * (m + 1) * noise)
    ill = 0
    for left in range(start, stop, step):
        p = min(left, stop - step)
        b0 = simd.load(one, zeroth, p) if apart else toeplitz.load_zeroth(one, b, p)
        total = b0 - simd.load(one, uniform, p)
        lit = total > 4.0 * simd.eps(one) * simd.absolute(b0)  # less is rounding
        factor = 1.0 / total
        re[0], im[0] = one, one * 0.0
        for k in range(1, m + 1):
            re[k], im[k] = simd.load_complex(one, b[k], p)
            re[k], im[k] = re[k] * factor, im[k] * factor
        fewer = lit & singular(order, re, im, ar, ai, gr, gi, inverse, floor)
        least, doubtful = floor, fewer & ~fewer
        if simd.some(fewer):
            # a little more in the diagonal makes all smaller blocks definite: the surplus returns
            # become as faint as that, wherever they are
            least = simd.select(fewer, 4.0 * floor, floor)
            factor = simd.select(fewer, 1.0 - 2.0 * floor, 1.0)
            for k in range(1, m + 1):
                re[k], im[k] = re[k] * factor, im[k] * factor
            singular(order, re, im, ar, ai, gr, gi, inverse, floor)
            for k in range(1, m + 1):
                re[k], im[k] = re[k] / factor, im[k] / factor
        circle_roots(order, ar, ai, turns, hr, hi, wr, wi, move)
        found = one * 0.0
        for i in range(m):
            w, x, y = weigh(order, gr, gi, inverse, wr[i], wi[i])
            zr, zi = x * x - y * y, 2.0 * x * y
            used = lit & (w > least) & (w * total > 0.0)
            # a surplus return next to one of the others takes a share of that one's weight
            doubtful = doubtful | (fewer & used & (w < _FAINT * floor))
            found = found + simd.select(used, one, 0.0)
            move[i] = simd.select(used, w, 0.0)
            wr[i] = simd.select(used, phase_of(zr, zi), simd.infinity(one))
            # what the returns leave of the moments
            ur, ui = move[i], im[0]
            re[0] = re[0] - ur
            for k in range(1, m + 1):
                ur, ui = ur * zr - ui * zi, ur * zi + ui * zr
                re[k], im[k] = re[k] - ur, im[k] - ui
        worst = re[0] * re[0]
        for k in range(1, m + 1):
            worst = worst + re[k] * re[k] + im[k] * im[k]  # NaN stays, as in no maximum
        worst = simd.select((worst < 1.0) & ~doubtful, simd.sqrt(worst), simd.infinity(one))
        worst = simd.select(lit, worst, 0.0)
        simd.store(residual, p, worst)
        ill += simd.count(worst > tolerance)
        _sort(order, wr, move)
        simd.store(count, p, found)
        for i in range(m):
            unused = wr[i] > 7.0
            simd.store(phase[i], p, simd.select(unused, simd.nan(one), wr[i]))
            simd.store(weight[i], p, simd.select(unused, 0.0, move[i] * total))
    return ill


@njit(forceinline=True, error_model="numpy")
def _sort(order: Any, keys: Any, values: Any) -> None:
    """Sort two banks by the first, ascending."""
    m = len(order)
    for i in range(m - 1):
        for k in range(m - 1 - i):
            swap = keys[k] > keys[k + 1]
            low, high = simd.minimum(keys[k], keys[k + 1]), simd.maximum(keys[k], keys[k + 1])
            first = simd.select(swap, values[k + 1], values[k])
            second = simd.select(swap, values[k], values[k + 1])
            keys[k], keys[k + 1], values[k], values[k + 1] = low, high, first, second


def half_turns(m: int, precision: str) -> Any:
    """Return cos and sin of pi k / m, k < m, one after the other."""
    angle = np.pi * np.arange(m) / m
    return np.concatenate([np.cos(angle), np.sin(angle)]).astype(precision)


def returns_entry(m: int, precision: str) -> Callable[..., Any]:
    """Compile the kernel of order m."""
    real, cplx = real_arrays(precision), complex_arrays(precision)
    return entry(
        find_returns,
        order_type(m),
        real[1],
        cplx[2],
        real[1],
        PIXELS,
        real[1],
        real[2],
        real[2],
        COUNTS,
        real[1],
        REAL,
        PIXELS,
        PIXELS,
    )
