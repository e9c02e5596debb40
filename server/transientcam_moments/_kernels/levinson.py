"""Levinson's recursion for every pixel."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes, ComplexPlanes, RealPlane, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.moments import load_harmonics, load_zeroth
from transientcam_moments._kernels.portable import bank
from transientcam_moments.arrays import Length
from transientcam_moments.moment_problem import toeplitz

_INTERLEAVE = 2


@njit(nogil=True, error_model="numpy")
def _levinson(
    order: Length,
    b: ComplexPlanes,
    zeroth: RealPlane,
    apart: int,
    error: RealPlane,
    polynomial: ComplexPlanes,
    reflection: ComplexPlanes,
    start: int,
    stop: int,
) -> None:
    """Write the coefficients of the pixels start..stop, b_0 from ``zeroth`` if it is ``apart``."""
    one = simd.ones(error, _INTERLEAVE)
    step = simd.width(one)
    re, im = bank(one, order, 1), bank(one, order, 1)
    ar, ai = bank(one, order, 1), bank(one, order, 1)
    gr, gi = bank(one, order, 0), bank(one, order, 0)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        re[0] = simd.load(one, zeroth, p) if apart else load_zeroth(one, b, p)
        load_harmonics(order, one, b, p, re, im)
        scale = toeplitz.relative(order, re, im)
        brightness = re[0] * scale
        toeplitz.physical(order, re, im)
        # a = E_m B^-1 e_0, what Eq. (2) is evaluated with (Theorem 1)
        simd.store(error, p, brightness * toeplitz.levinson(order, re, im, ar, ai, gr, gi))
        simd.store_complex(polynomial[0], p, one, one * 0.0)
        for j in range(len(order)):
            simd.store_complex(polynomial[j + 1], p, ar[j + 1], ai[j + 1])
            simd.store_complex(reflection[j], p, gr[j], gi[j])


def levinson_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile Levinson's recursion of order m; see the table in ``_kernels``."""
    order = (0,) * m
    run = entry(_levinson, m, precision)

    def kernel(
        b: Complexes, brightness: Reals | None = None, *, spread: Spread = at_once
    ) -> tuple[Any, Any, Any]:
        shape, pixels = b.shape[1:], b[0].size
        planes = np.ascontiguousarray(b).reshape(m + 1, pixels)
        error = empty(pixels, precision)
        polynomial = empty(planes.shape, planes.dtype)
        reflection = empty(planes[1:].shape, planes.dtype)
        zeroth, apart = error, 0
        if brightness is not None:
            zeroth, apart = np.ascontiguousarray(brightness, precision).reshape(pixels), 1

        def part(start: int, stop: int) -> None:
            run(order, planes, zeroth, apart, error, polynomial, reflection, start, stop)

        spread(part, pixels)
        return (
            error.reshape(shape),
            polynomial.reshape((m + 1, *shape)),
            reflection.reshape((m, *shape)),
        )

    return kernel
