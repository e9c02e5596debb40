"""One round of taking known harmonics out of the moments of every pixel."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes, ComplexPlanes, Places, RealPlane
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.portable import bank, square_bank
from transientcam_moments.arrays import Length
from transientcam_moments.moment_problem import extension

MOST_ODD = 31
"""The highest harmonic there is room for: b_0 .. b_31m in (m + 12)^2 registers."""


@njit(nogil=True, error_model="numpy")
def _without_harmonics(
    order: Length,
    odd: Places,
    given: ComplexPlanes,
    current: ComplexPlanes,
    polynomial: ComplexPlanes,
    mixed: ComplexPlanes,
    inverse: ComplexPlanes,
    following: ComplexPlanes,
    misfit: RealPlane,
    start: int,
    stop: int,
) -> None:
    m = len(order)
    one = simd.ones(misfit, 1)
    step = simd.width(one)
    re, im = square_bank(one, order, 12), square_bank(one, order, 12)
    ar, ai = bank(one, order, 1), bank(one, order, 1)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        for j in range(1, m + 1):
            re[j], im[j] = simd.load_complex(one, current[j], p)
            ar[j], ai[j] = simd.load_complex(one, polynomial[j], p)
        extension.extend(order, m * odd[-1], ar, ai, re, im)
        x, y = simd.load_complex(one, given[0], p)
        simd.store_complex(following[0], p, x, y)
        distance = one * 0.0
        for j in range(1, m + 1):
            x, y = simd.load_complex(one, given[j], p)
            for i in range(len(odd)):
                k = odd[i]
                dr, di = simd.load_complex(one, mixed[i * m + j - 1], p)
                x, y = extension.without_harmonic(k, dr, di, re[k * j], im[k * j], x, y)
            dr, di = simd.load_complex(one, inverse[j - 1], p)
            new_re, new_im = x * dr - y * di, x * di + y * dr
            simd.store_complex(following[j], p, new_re, new_im)
            off_re, off_im = new_re - re[j], new_im - im[j]
            distance = distance + (off_re * off_re + off_im * off_im)
        simd.store(misfit, p, distance)


def harmonics_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the round of order m; see the table in ``_kernels``."""
    order = (0,) * m
    run = entry(_without_harmonics, m, precision)

    def kernel(
        given: Complexes,
        current: Complexes,
        polynomial: Complexes,
        mixed: Complexes,
        inverse: Complexes,
        orders: tuple[int, ...],
        *,
        spread: Spread = at_once,
    ) -> tuple[Any, Any] | None:
        if orders[-1] > MOST_ODD:
            return None
        odd = np.array(orders, dtype=np.int64)
        inputs = [np.ascontiguousarray(each) for each in (given, current, polynomial, mixed)]
        following = np.empty_like(inputs[0])
        misfit = np.empty(following.shape[1], precision)
        scale = np.ascontiguousarray(inverse)

        def part(start: int, stop: int) -> None:
            run(order, odd, *inputs, scale, following, misfit, start, stop)

        spread(part, following.shape[1])
        return following, misfit

    return kernel
