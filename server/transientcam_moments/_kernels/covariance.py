"""The covariance of m returns that m harmonics determine."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Reals
from transientcam_moments._kernels.compiled_entry import PIXELS, entry, order_type, real_arrays
from transientcam_moments._kernels.portable import bank, root, square_bank
from transientcam_moments.arrays import Length


@njit(nogil=True, error_model="numpy")
def covariance(
    order: Length,
    both: Length,
    basis: Reals,
    turned: Reals,
    variance: Reals,
    out: Reals,
    start: int,
    stop: int,
) -> None:
    """Write (4 m^2, P) of the pixels start..stop; ``both`` is a tuple of length 2m.

    ``turned`` (2m, P) holds cos and sin of half the phases. Row i of ``basis`` (2m + 1, 2m + 3)
    holds what takes the value at node i to the mean of a polynomial, to its cosines and its sines,
    then cos and sin of the node.
    """
    m, nodes = len(order), len(both) + 1
    one = simd.ones(out, 1)
    step = simd.width(one)
    x, y = bank(one, order, 0), bank(one, order, 0)
    scale, slope = bank(one, order, 0), bank(one, order, 0)
    zero, before = bank(one, order, 0), bank(one, order, 0)
    std = bank(one, order, 0)
    values, spectrum = square_bank(one, both, 1), square_bank(one, both, 1)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        for k in range(m):
            x[k], y[k] = simd.load(one, turned[k], p), simd.load(one, turned[m + k], p)
            std[k] = root(simd.load(one, variance[k], p))
        for k in range(m):
            others, total = one, one * 0.0
            for other in range(m):
                if other != k:
                    cosine = x[k] * x[other] + y[k] * y[other]
                    sine = y[k] * x[other] - x[k] * y[other]
                    others = others * (2.0 * sine * sine)
                    total = total + cosine / sine
            scale[k], slope[k] = 1.0 / others, total
        for k in range(m):
            x[k], y[k] = x[k] * x[k] - y[k] * y[k], 2.0 * x[k] * y[k]
        for i in range(nodes):
            c, s = basis[i, nodes], basis[i, nodes + 1]
            product = one
            for k in range(m):
                zero[k] = 1.0 - (x[k] * c + y[k] * s)
                before[k] = product
                product = product * zero[k]
            values[2 * m * nodes + i] = product
            after = one
            for k in range(m - 1, -1, -1):
                away = before[k] * after * scale[k]
                after = after * zero[k]
                sloping = away * (x[k] * s - y[k] * c)
                values[k * nodes + i] = away - slope[k] * sloping
                values[(m + k) * nodes + i] = sloping
        for row in range(nodes):
            for j in range(nodes):
                total = one * 0.0
                for i in range(nodes):
                    total = total + values[row * nodes + i] * basis[i, j]
                spectrum[row * nodes + j] = total
        for row in range(2 * m):
            share = spectrum[row * nodes] / spectrum[2 * m * nodes]
            for j in range(2 * m):
                at = row * nodes + 1 + j
                rest = spectrum[at] - share * spectrum[2 * m * nodes + 1 + j]
                spectrum[at] = rest * std[j % m]
            for column in range(row + 1):
                total = one * 0.0
                for j in range(1, nodes):
                    total = total + spectrum[row * nodes + j] * spectrum[column * nodes + j]
                simd.store(out[2 * m * row + column], p, total)
                simd.store(out[2 * m * column + row], p, total)


def covariance_entry(m: int) -> Callable[..., Any]:
    """Compile the kernel of order m, in double precision."""
    planes = real_arrays("d")[2]
    return entry(
        covariance,
        order_type(m), order_type(2 * m), planes, planes, planes, planes, PIXELS, PIXELS,
    )  # fmt: skip


def interpolation(m: int) -> Any:
    """Return the ``basis`` of the kernel of order m."""
    node = 2 * np.pi / (2 * m + 1) * np.arange(2 * m + 1)
    harmonic = np.outer(node, np.arange(1, m + 1))
    polynomial = np.concatenate(
        [np.full((2 * m + 1, 1), 0.5), np.cos(harmonic), np.sin(harmonic)], 1
    )
    return np.column_stack([polynomial * (2 / len(node)), np.cos(node), np.sin(node)])


def half_turned(phase: Reals) -> Any:
    """Return cos and sin (2m, P) of half the phases (m, P)."""
    half = 0.5 * phase
    return np.concatenate([np.cos(half), np.sin(half)])


def covariance_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the covariance of order m; see the table in ``_kernels``."""
    order, both = (0,) * m, (0,) * (2 * m)
    run, basis = covariance_entry(m), interpolation(m)

    def lane(phase: Reals, variance: Reals, *, spread: Spread = at_once) -> Any:
        turned, planes = half_turned(phase), np.ascontiguousarray(variance)
        out = np.empty((4 * m * m, phase.shape[1]))
        spread(
            lambda start, stop: run(order, both, basis, turned, planes, out, start, stop),
            phase.shape[1],
        )
        return out.reshape((2 * m, 2 * m, -1))

    return lane
