"""Pisarenko's returns for one register of pixels at a time, expanded into the kernels.

``order`` is a tuple of length m; banks of registers are taken and filled. Points of the unit circle
are kept as half angles (see `circle`).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import simd, toeplitz
from transientcam_moments._kernels.circle import circle_roots
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
_LATE = 1024  # pixels that are redone with more steps at a time
MOST_STEPS = 24
"""Of the iteration for roots, for pixels that need more than the others."""


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
        x, y = toeplitz.reflect(k, re, im, ar, ai, inverse[k - 1])
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
    w = 1.0 / total
    turn = -(real / imag) * (tr * tr + ti * ti) * inverse[m - 1] * w
    return w, x - y * turn, y + x * turn


@njit(nogil=True, error_model="numpy")
def _returns(
    order: Any,
    turns: Any,
    b: Any,
    zeroth: Any,
    apart: int,
    uniform: Any,
    phase: Any,
    weight: Any,
    count: Any,
    residual: Any,
    noise: float,
    steps: int,
    start: int,
    stop: int,
) -> int:
    """Do as `find_returns` does, but with no more than ``steps`` towards the roots."""
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
        circle_roots(order, ar, ai, turns, hr, hi, wr, wi, move, steps)
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
        sort(order, wr, move)
        simd.store(count, p, found)
        for i in range(m):
            unused = wr[i] > 7.0
            simd.store(phase[i], p, simd.select(unused, simd.nan(one), wr[i]))
            simd.store(weight[i], p, simd.select(unused, 0.0, move[i] * total))
    return ill


@njit(nogil=True, error_model="numpy")
def find_returns(
    order: Any,
    turns: Any,
    b: Any,
    zeroth: Any,
    apart: int,
    uniform: Any,
    phase: Any,
    weight: Any,
    count: Any,
    residual: Any,
    noise: float,
    steps: int,
    start: int,
    stop: int,
) -> int:
    """Write the returns of the pixels start..stop, whose smallest eigenvalues are known.

    b_0 comes from ``zeroth`` if it is ``apart``.

    ``noise`` is the precision of the data. ``residual`` becomes the error of all moments that
    the returns leave, relative to their sum; infinite where they could not be found, 0 where there
    is no light. Returns how many pixels have one larger than rounding explains.

    Pixels share registers, and each step is done for all of them. So after ``steps`` those that do
    not reproduce their moments are packed, and done again with as many as they need.
    """
    ill = _returns(
        order, turns, b, zeroth, apart, uniform, phase, weight, count, residual, noise,
        steps, start, stop,
    )  # fmt: skip
    if ill == 0 or steps >= MOST_STEPS:
        return ill
    m = len(order)
    tolerance = 16.0 * (m + 1) * noise
    where = np.empty(_LATE, np.int64)
    moments = np.empty((m + 1, _LATE), b.dtype)
    late_zeroth, late_uniform = np.empty(_LATE, uniform.dtype), np.empty(_LATE, uniform.dtype)
    late_phase = np.empty((m, _LATE), uniform.dtype)
    late_weight = np.empty_like(late_phase)
    late_count, late_residual = np.empty(_LATE, count.dtype), np.empty(_LATE, uniform.dtype)
    ill, begin = 0, start
    while begin < stop:
        late = 0
        while begin < stop and late < _LATE:
            where[late] = begin
            late += int(residual[begin] > tolerance)
            begin += 1
        whole = -(-late // LEAST_PIXELS) * LEAST_PIXELS
        for i in range(late, whole):
            where[i] = where[0]
        for i in range(whole):
            p = where[i]
            late_zeroth[i] = zeroth[p] if apart else b[0, p].real
            late_uniform[i] = uniform[p]
            for j in range(1, m + 1):
                moments[j, i] = b[j, p]
        _returns(
            order, turns, moments, late_zeroth, True, late_uniform, late_phase, late_weight,
            late_count, late_residual, noise, MOST_STEPS, 0, whole,
        )  # fmt: skip
        for i in range(late):
            p = where[i]
            count[p], residual[p] = late_count[i], late_residual[i]
            ill += int(residual[p] > tolerance)
            for k in range(m):
                phase[k, p], weight[k, p] = late_phase[k, i], late_weight[k, i]
    return ill


@njit(forceinline=True, error_model="numpy")
def sort(order: Any, keys: Any, values: Any) -> None:
    """Sort two banks by the first, ascending."""
    m = len(order)
    for i in range(m - 1):
        for k in range(m - 1 - i):
            swap = keys[k] > keys[k + 1]
            low, high = simd.minimum(keys[k], keys[k + 1]), simd.maximum(keys[k], keys[k + 1])
            first = simd.select(swap, values[k + 1], values[k])
            second = simd.select(swap, values[k], values[k + 1])
            keys[k], keys[k + 1], values[k], values[k + 1] = low, high, first, second


def usual_steps(m: int, precision: str) -> int:
    """Return how many steps towards the roots all pixels are given: nine of ten need no more.

    Fewest of processor time with m = 3, 4 and 8 in single precision (decision 11).
    """
    return (3 if m < 6 else 5) + (precision == "d")


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
        PIXELS,
    )
