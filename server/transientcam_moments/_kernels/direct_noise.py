"""The deviation of the direct return's phase, for a sample of a frame's pixels."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._kernels.arrays import Reals
from transientcam_moments._kernels.compiled_entry import (
    PIXELS,
    REAL,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.covariance import (
    covariance,
    covariance_entry,
    half_turned,
    interpolation,
)
from transientcam_moments.arrays import Length


@njit(nogil=True, error_model="numpy")
def _direct_noise(
    order: Length, both: Length, basis: Reals, turned: Reals, phase: Reals, weight: Reals,
    variance: Reals, threshold: float, clear: float, coincide_rad: float, out: Reals, found: Reals,
    pixels: int,
) -> None:  # fmt: skip
    """Fill ``found`` (3, P): deviation, whether first order holds, whether there are m returns.

    The statements are those of `noise.returns`, a pixel at a time. ``out`` (4 m^2, P) is room.
    """
    m = len(order)
    covariance(order, both, basis, turned, variance, out, 0, pixels)
    for p in range(pixels):
        strongest, spread = 0.0, 0.0
        there = True
        for k in range(m):
            there = there and weight[k, p] > 0.0 and math.isfinite(phase[k, p])
            strongest = max(strongest, weight[k, p])
            for other in range(k):
                apart = abs(phase[k, p] - phase[other, p])
                there = there and min(apart, 2.0 * math.pi - apart) > coincide_rad
        found[2, p] = there
        if not there:
            continue
        is_first, holds, before = True, True, 0.0
        for k in range(m):  # of the strongest, by which it is decided which return is direct
            if weight[k, p] == strongest:
                spread = max(spread, threshold * math.sqrt(out[(2 * m + 1) * k, p]))
        for k in range(m):
            w = weight[k, p]
            of_weight = math.sqrt(out[(2 * m + 1) * k, p])
            of_phase = math.sqrt(out[(2 * m + 1) * (m + k), p]) / w
            holds = holds and w > clear * of_weight
            holds = holds and min(phase[k, p], 2.0 * math.pi - phase[k, p]) > clear * of_phase
            if k > 0:
                mixed = out[2 * m * (m + k - 1) + m + k, p] / (weight[k - 1, p] * w)
                variance_apart = max(before * before + of_phase * of_phase - 2.0 * mixed, 0.0)
                apart = phase[k, p] - phase[k - 1, p]
                holds = holds and apart > clear * math.sqrt(variance_apart)
            before = of_phase
            if is_first:
                decided = abs(w - threshold * strongest) > clear * (of_weight + spread)
                holds = holds and (decided or w == strongest)
                if w >= threshold * strongest:
                    is_first = False
                    found[0, p] = of_phase
        found[1, p] = holds


def direct_noise_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the deviation of order m; see the table in ``_kernels``."""
    order, both = (0,) * m, (0,) * (2 * m)
    covariance_entry(m)  # which is linked
    planes = real_arrays(precision)[2]
    run = entry(
        _direct_noise,
        order_type(m), order_type(2 * m), planes, planes, planes, planes, planes, REAL, REAL, REAL,
        planes, planes, PIXELS,
    )  # fmt: skip
    basis = interpolation(m)

    def lane(
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
            order, both, basis, half_turned(phase), np.ascontiguousarray(phase),
            np.ascontiguousarray(weight), np.ascontiguousarray(variance), threshold, clear,
            coincide_rad, out, found, pixels,
        )  # fmt: skip
        return found[0], found[1] > 0, found[2] > 0

    return lane
