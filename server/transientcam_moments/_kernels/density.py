"""Eq. (2) for many pixels and phases: one pass over blocks of pixels that stay in cache."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_moments._kernels import simd, toeplitz
from transientcam_moments._kernels.entries import (
    PIXELS,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.spread import Spread, at_once

_BANK = 240  # pairs of registers of coefficients, which stay in the first cache for all phases
_PAST_CACHES_BYTES = 1 << 24


@njit(forceinline=True, error_model="numpy")
def _two_phases(order: Any, q: Any, pitch: int, p: int, c0: Any, s0: Any, c1: Any, s1: Any) -> Any:
    """Evaluate Eq. (2) for the pixels from ``p`` on at two phases, which share the loads."""
    # sum_j conj(a_j) exp(i j phi), a_0 = 1
    re, im = simd.load_within(q, 2 * pitch + p), simd.load_within(q, 3 * pitch + p)
    x0, y0 = 1.0 + re * c0[0] + im * s0[0], re * s0[0] - im * c0[0]
    x1, y1 = 1.0 + re * c1[0] + im * s1[0], re * s1[0] - im * c1[0]
    for j in range(1, len(order)):
        re = simd.load_within(q, (2 * j + 2) * pitch + p)
        im = simd.load_within(q, (2 * j + 3) * pitch + p)
        x0, y0 = x0 + re * c0[j] + im * s0[j], y0 + re * s0[j] - im * c0[j]
        x1, y1 = x1 + re * c1[j] + im * s1[j], y1 + re * s1[j] - im * c1[j]
    scale, least = simd.load_within(q, p), simd.load_within(q, pitch + p)
    return (
        scale / simd.maximum(x0 * x0 + y0 * y0, least),
        scale / simd.maximum(x1 * x1 + y1 * y1, least),
    )


@njit(nogil=True, error_model="numpy")
def _density(
    order: Any,
    polynomial: Any,
    reflection: Any,
    error: Any,
    cosine: Any,
    sine: Any,
    out: Any,
    start: int,
    stop: int,
    twin: int,
) -> None:
    """Write the density at phases (T, m) into ``out`` (T * P) for the pixels start..stop.

    With ``twin`` > 0 rows are written past the caches, whole lines of memory at a time: each row
    begins at its own first line, and rows ``twin`` apart begin alike.
    """
    m = len(order)
    one = simd.ones(error, 2)
    step = simd.width(one)
    pitch = _BANK // (2 * m + 2) * step
    block = pitch - step  # rows that begin at a line of memory reach into the next block
    pixels = error.shape[0]
    q = simd.registers(one, (), _BANK)
    c0, s0 = simd.registers(one, order, 0), simd.registers(one, order, 0)
    c1, s1 = simd.registers(one, order, 0), simd.registers(one, order, 0)
    phases = cosine.shape[0]
    distance = max(1, twin)
    left = start
    while left < stop:
        left = min(left, stop - step)
        size = min(block, stop - left)
        held = min(size + step, stop - left)
        for i in range(0, held, step):
            p = min(i, held - step)
            simd.store_within(q, p, simd.load(one, error, left + p) * (0.5 / np.pi))
            least = simd.eps(one)
            for j in range(m):
                re, im = simd.load_complex(one, polynomial[j + 1], left + p)
                simd.store_within(q, (2 * j + 2) * pitch + p, re)
                simd.store_within(q, (2 * j + 3) * pitch + p, im)
                re, im = simd.load_complex(one, reflection[j], left + p)
                least = least * toeplitz.below_one(re, im)  # eps E / b_0
            simd.store_within(q, pitch + p, least)
        for pair in range(phases):
            t = pair // distance * 2 * distance + pair % distance
            if t >= phases:
                continue
            u = t + distance if t + distance < phases else t
            for j in range(m):
                c0[j], s0[j] = simd.spread(one, cosine[t, j]), simd.spread(one, sine[t, j])
                c1[j], s1[j] = simd.spread(one, cosine[u, j]), simd.spread(one, sine[u, j])
            first, second = t * pixels + left, u * pixels + left
            begin, end = 0, size
            if twin:
                begin = min(simd.before_boundary(out, first), size)
                end = min(size + begin, held)
                for p in range(begin, end - step + 1, step):
                    h0, h1 = _two_phases(order, q, pitch, p, c0, s0, c1, s1)
                    simd.stream(out, first + p, h0)
                    simd.stream(out, second + p, h1)
                if left == start and begin > 0:
                    h0, h1 = _two_phases(order, q, pitch, 0, c0, s0, c1, s1)
                    simd.store(out, first, h0)
                    simd.store(out, second, h1)
            else:
                for p in range(0, size - step + 1, step):
                    h0, h1 = _two_phases(order, q, pitch, p, c0, s0, c1, s1)
                    simd.store(out, first + p, h0)
                    simd.store(out, second + p, h1)
            if (end - begin) % step:
                p = end - step
                h0, h1 = _two_phases(order, q, pitch, p, c0, s0, c1, s1)
                simd.store(out, first + p, h0)
                simd.store(out, second + p, h1)
        left += size
    if twin:
        simd.fence()


def density_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the density of order m; see the table in ``_kernels`` for what it takes."""
    order = (0,) * m
    real, cplx = real_arrays(precision), complex_arrays(precision)
    run = entry(
        _density,
        order_type(m),
        cplx[2],
        cplx[2],
        real[1],
        real[2],
        real[2],
        real[1],
        PIXELS,
        PIXELS,
        PIXELS,
    )

    def lane(
        polynomial: Any,
        reflection: Any,
        error: Any,
        phase_rad: Any,
        out: Any = None,
        *,
        spread: Spread = at_once,
    ) -> Any:
        pixels = polynomial[0].size
        a = np.ascontiguousarray(polynomial).reshape(m + 1, pixels)
        g = np.ascontiguousarray(reflection).reshape(m, pixels)
        scale = np.ascontiguousarray(error).reshape(pixels)
        angles = np.multiply.outer(np.asarray(phase_rad, np.float64), np.arange(1, m + 1))
        cosine, sine = np.cos(angles).astype(precision), np.sin(angles).astype(precision)
        if out is None:
            out = np.empty((len(angles), *polynomial.shape[1:]), precision)
        flat = out.reshape(-1)
        twin = 0
        if out.nbytes > _PAST_CACHES_BYTES:
            twin = simd.REGISTER_BYTES // math.gcd(simd.REGISTER_BYTES, pixels * out.itemsize)

        def part(start: int, stop: int) -> None:
            run(order, a, g, scale, cosine, sine, flat, start, stop, twin)

        spread(part, pixels)
        return out

    return lane
