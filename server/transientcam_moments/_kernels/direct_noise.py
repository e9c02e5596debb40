"""The deviation of the direct return's phase, for a sample of a frame's pixels."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import RealPlanes, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.covariance import covariance
from transientcam_moments._kernels.portable import bank, root, select
from transientcam_moments.arrays import Length
from transientcam_moments.noise import first_order, interpolation


@njit(nogil=True, error_model="numpy")
def _direct_noise(
    order: Length, both: Length, basis: RealPlanes, turned: RealPlanes, phase: RealPlanes, weight:
    RealPlanes, variance: RealPlanes, threshold: float, clear: float, coincide_rad: float, out:
    RealPlanes, found: RealPlanes, pixels: int,
) -> None:  # fmt: skip
    """Fill ``found`` (3, P): deviation, whether first order holds, whether there are m returns.

    ``out`` (4 m^2, P) is room.
    """
    m = len(order)
    covariance(order, both, basis, turned, variance, out, 0, pixels)
    one = simd.ones(out, 1)
    step = simd.width(one)
    phases, weights, mixed = bank(one, order, 0), bank(one, order, 0), bank(one, order, 0)
    phase_std, weight_std = bank(one, order, 0), bank(one, order, 0)
    for left in range(0, pixels, step):
        p = min(left, pixels - step)
        for k in range(m):
            phases[k], weights[k] = simd.load(one, phase[k], p), simd.load(one, weight[k], p)
            weight_std[k] = root(simd.load(one, out[(2 * m + 1) * k], p))
            phase_std[k] = root(simd.load(one, out[(2 * m + 1) * (m + k)], p)) / weights[k]
            mixed[k] = simd.load(one, out[2 * m * (m + max(k - 1, 0)) + m + k], p)
        std, holds = first_order.direct_noise(
            order, threshold, clear, phases, weights, phase_std, weight_std, mixed
        )
        there = first_order.resolved(order, coincide_rad, phases, weights)
        simd.store(found[0], p, std)
        simd.store(found[1], p, select(holds, one, 0.0))
        simd.store(found[2], p, select(there, one, 0.0))


def direct_noise_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the deviation of order m; see the table in ``_kernels``."""
    order, both = (0,) * m, (0,) * (2 * m)
    entry(covariance, m, precision, both=2 * m)  # which is linked
    run = entry(_direct_noise, m, precision, both=2 * m)
    basis = interpolation.basis(m)

    def kernel(
        phase: Reals,
        weight: Reals,
        variance: Reals,
        threshold: float,
        clear: float,
        coincide_rad: float,
        *,
        spread: Spread = at_once,
    ) -> Any:
        pixels = phase.shape[1]
        found, out = np.zeros((3, pixels)), np.empty((4 * m * m, pixels))
        run(
            order, both, basis, interpolation.half_turned(phase), np.ascontiguousarray(phase),
            np.ascontiguousarray(weight), np.ascontiguousarray(variance), threshold, clear,
            coincide_rad, out, found, pixels,
        )  # fmt: skip
        return found[0], found[1] > 0, found[2] > 0

    return kernel
