"""The covariance of m returns that m harmonics determine."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import RealPlanes, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.portable import bank, square_bank
from transientcam_moments.arrays import Length
from transientcam_moments.noise import interpolation


@njit(nogil=True, error_model="numpy")
def covariance(
    order: Length,
    both: Length,
    basis: RealPlanes,
    turned: RealPlanes,
    variance: RealPlanes,
    out: RealPlanes,
    start: int,
    stop: int,
) -> None:
    """Write (4 m^2, P) of the pixels start..stop; ``both`` is a tuple of length 2m.

    ``turned`` (2m, P) and ``basis`` are from `half_turned` and `basis` of `noise.interpolation`.
    """
    m = len(order)
    one = simd.ones(out, 1)
    step = simd.width(one)
    x, y, data = bank(one, order, 0), bank(one, order, 0), bank(one, order, 0)
    found = square_bank(one, both, 0)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        for k in range(m):
            x[k], y[k] = simd.load(one, turned[k], p), simd.load(one, turned[m + k], p)
            data[k] = simd.load(one, variance[k], p)
        interpolation.covariance(order, both, basis, one, x, y, data, found)
        for row in range(2 * m):
            for column in range(row + 1):
                total = found[2 * m * row + column]
                simd.store(out[2 * m * row + column], p, total)
                simd.store(out[2 * m * column + row], p, total)


def covariance_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the covariance of order m; see the table in ``_kernels``."""
    order, both = (0,) * m, (0,) * (2 * m)
    run, basis = entry(covariance, m, "d", both=2 * m), interpolation.basis(m)

    def kernel(phase: Reals, variance: Reals, *, spread: Spread = at_once) -> Any:
        turned, planes = interpolation.half_turned(phase), np.ascontiguousarray(variance)
        out = np.empty((4 * m * m, phase.shape[1]))
        spread(
            lambda start, stop: run(order, both, basis, turned, planes, out, start, stop),
            phase.shape[1],
        )
        return out.reshape((2 * m, 2 * m, -1))

    return kernel
