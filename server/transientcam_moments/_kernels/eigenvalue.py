"""The smallest eigenvalue of every pixel's Toeplitz matrix."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes, ComplexPlanes, RealPlane
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.moments import load_harmonics, load_zeroth
from transientcam_moments._kernels.portable import bank
from transientcam_moments.arrays import Length
from transientcam_moments.moment_problem import eigenvalue, toeplitz

_INTERLEAVE = 4


@njit(nogil=True, error_model="numpy")
def smallest_eigenvalue(
    order: Length, b: ComplexPlanes, without: int, out: RealPlane, start: int, stop: int
) -> None:
    """Write the smallest eigenvalues of the pixels start..stop, with or ``without`` b_0."""
    one = simd.ones(out, _INTERLEAVE)
    step = simd.width(one)
    re, im = bank(one, order, 1), bank(one, order, 1)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        re[0] = one * 0.0
        if not without:
            re[0] = load_zeroth(one, b, p)
        load_harmonics(order, one, b, p, re, im)
        scale = toeplitz.relative(order, re, im)
        simd.store(out, p, scale * eigenvalue.smallest_eigenvalue(order, re, im))


def smallest_eigenvalue_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the smallest eigenvalue of order m; see the table in ``_kernels``."""
    order = (0,) * m
    run = entry(smallest_eigenvalue, m, precision)

    def kernel(b: Complexes, *, spread: Spread = at_once) -> Any:
        pixels = b[0].size
        planes = np.ascontiguousarray(b).reshape(m + 1, pixels)
        out = empty(pixels, precision)
        spread(lambda start, stop: run(order, planes, 0, out, start, stop), pixels)
        return out.reshape(b.shape[1:])

    return kernel
