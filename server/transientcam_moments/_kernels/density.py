"""Eq. (2) for many pixels and phases: one pass over blocks of pixels that stay in cache."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from transientcam_moments._kernels import simd, toeplitz
from transientcam_moments._kernels.compiled_entry import (
    FLAG,
    PIXELS,
    PLACES,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._lanes.parallel import Spread, at_once
from transientcam_moments._lanes.registry import LEAST_PIXELS

_BANK = 240  # pairs of registers of coefficients, which stay in the first cache for all phases
_PAST_CACHES_BYTES = 1 << 24
_LEAST_MIRRORED = 8
_REMEMBERED = 4096  # phases; more are a computation rather than a film


@njit(forceinline=True, error_model="numpy")
def _any_two(order: Any, q: Any, pitch: int, p: int, c0: Any, s0: Any, c1: Any, s1: Any) -> Any:
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


@njit(forceinline=True, error_model="numpy")
def _mirrored_two(order: Any, q: Any, pitch: int, p: int, c: Any, s: Any) -> Any:
    """Evaluate Eq. (2) at two phases as far before as behind the one to which q is turned.

    With conj(a_j) turned to u + i v it is sum_j (u c - v s) + i (u s + v c), and s changes sign:
    the same four sums serve both.
    """
    u, v = simd.load_within(q, 2 * pitch + p), simd.load_within(q, 3 * pitch + p)
    uc, vs, us, vc = 1.0 + u * c[0], v * s[0], u * s[0], v * c[0]
    for j in range(1, len(order)):
        u = simd.load_within(q, (2 * j + 2) * pitch + p)
        v = simd.load_within(q, (2 * j + 3) * pitch + p)
        uc, vs, us, vc = uc + u * c[j], vs + v * s[j], us + u * s[j], vc + v * c[j]
    scale, least = simd.load_within(q, p), simd.load_within(q, pitch + p)
    x0, y0, x1, y1 = uc - vs, vc + us, uc + vs, vc - us
    return (
        scale / simd.maximum(x0 * x0 + y0 * y0, least),
        scale / simd.maximum(x1 * x1 + y1 * y1, least),
    )


@njit(forceinline=True, error_model="numpy")
def _two(
    order: Any, q: Any, pitch: int, p: int, c0: Any, s0: Any, c1: Any, s1: Any, mirrored: bool
) -> Any:
    if mirrored:
        return _mirrored_two(order, q, pitch, p, c0, s0)
    return _any_two(order, q, pitch, p, c0, s0, c1, s1)


@njit(nogil=True, error_model="numpy")
def _density(
    order: Any,
    polynomial: Any,
    reflection: Any,
    error: Any,
    rows: Any,
    waves: Any,
    centre: Any,
    out: Any,
    start: int,
    stop: int,
    mirrored: bool,
    past_caches: bool,
) -> None:
    """Write the density at phases in pairs into ``out`` (T * P) for the pixels start..stop.

    ``rows`` (2 n) holds the rows of the first and of the second of each pair, which are the same
    for one alone; the first is written last. ``waves`` (n, 4 m) holds cos and sin of j phi for
    both; ``mirrored``, of the distance from the phase of ``centre`` (2 m).

    ``past_caches``, whole lines of memory are written at a time: each row begins at its own first
    line, where both of a pair begin alike.
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
    pairs = waves.shape[0]
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
                if mirrored:  # conj(a_j) exp(i j centre)
                    c, s = simd.spread(one, centre[j]), simd.spread(one, centre[m + j])
                    re, im = re * c + im * s, re * s - im * c
                simd.store_within(q, (2 * j + 2) * pitch + p, re)
                simd.store_within(q, (2 * j + 3) * pitch + p, im)
                re, im = simd.load_complex(one, reflection[j], left + p)
                least = least * toeplitz.below_one(re, im)  # eps E / b_0
            simd.store_within(q, pitch + p, least)
        for pair in range(pairs):
            wave = waves[pair]
            for j in range(m):
                c0[j], s0[j] = simd.spread(one, wave[j]), simd.spread(one, wave[m + j])
                c1[j], s1[j] = simd.spread(one, wave[2 * m + j]), simd.spread(one, wave[3 * m + j])
            first, second = rows[pair] * pixels + left, rows[pairs + pair] * pixels + left
            begin, end = 0, size
            if past_caches:
                begin = min(simd.before_boundary(out, first), size)
                end = min(size + begin, held)
                for p in range(begin, end - step + 1, step):
                    h0, h1 = _two(order, q, pitch, p, c0, s0, c1, s1, mirrored)
                    simd.stream(out, second + p, h1)
                    simd.stream(out, first + p, h0)
                if left == start and begin > 0:
                    h0, h1 = _two(order, q, pitch, 0, c0, s0, c1, s1, mirrored)
                    simd.store(out, second, h1)
                    simd.store(out, first, h0)
            else:
                for p in range(0, size - step + 1, step):
                    h0, h1 = _two(order, q, pitch, p, c0, s0, c1, s1, mirrored)
                    simd.store(out, second + p, h1)
                    simd.store(out, first + p, h0)
            if (end - begin) % step:
                p = end - step
                h0, h1 = _two(order, q, pitch, p, c0, s0, c1, s1, mirrored)
                simd.store(out, second + p, h1)
                simd.store(out, first + p, h0)
        left += size
    if past_caches:
        simd.fence()


class Pairs(NamedTuple):
    """Phases in pairs, as the kernel takes them."""

    rows: Any
    waves: Any
    centre: Any
    mirrored: bool


def paired(phase_rad: Any, m: int, precision: str, alike: int) -> Pairs:
    """Pair phases so that rows of a pair are a multiple of ``alike`` apart.

    Where phases are equidistant, the first goes with the last: then both need half the work.
    """
    phases = phase_rad.size
    t = np.arange(phases)
    # with whole turns of rows that begin alike, those at either end of an odd number do
    fold = phases - (phases - 1) % alike
    mirrored = alike <= 2 and phases >= _LEAST_MIRRORED and _equidistant(phase_rad)
    centre = 0.0
    if mirrored:
        first, second = t[: (fold + 1) // 2], fold - 1 - t[: (fold + 1) // 2]
        first, second = np.append(first, t[fold:]), np.append(second, t[fold:])
        centre = (phase_rad[0] + phase_rad[fold - 1]) / 2
    else:
        first = t[t % (2 * alike) < alike]
        second = np.where(first + alike < phases, first + alike, first)
    order = np.arange(1, m + 1)
    waves = [
        wave(np.multiply.outer(phase_rad[rows] - centre, order))
        for rows in (first, second)
        for wave in (np.cos, np.sin)
    ]
    turn = np.concatenate([np.cos(centre * order), np.sin(centre * order)])
    return Pairs(
        np.concatenate([first, second]),
        np.concatenate(waves, axis=1).astype(precision),
        turn.astype(precision),
        mirrored,
    )


@lru_cache(maxsize=16)
def _paired_before(phase_rad: bytes, m: int, precision: str, alike: int) -> Pairs:
    return paired(np.frombuffer(phase_rad), m, precision, alike)


def _equidistant(phase_rad: Any) -> bool:
    """Say whether phases are equidistant, but for the rounding of their own digits."""
    even = np.linspace(phase_rad[0], phase_rad[-1], phase_rad.size)
    digits = np.finfo(float).eps * np.abs(phase_rad[[0, -1]]).max()
    return bool(np.abs(phase_rad - even).max() <= 4 * digits)


def density_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the density of order m; see the table in ``_kernels`` for what it takes."""
    order = (0,) * m
    real, cplx = real_arrays(precision), complex_arrays(precision)
    run = entry(
        _density,
        order_type(m), cplx[2], cplx[2], real[1], PLACES, real[2], real[1], real[1],
        PIXELS, PIXELS, FLAG, FLAG,
    )  # fmt: skip

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
        phases = np.asarray(phase_rad, np.float64)
        if out is None:
            out = np.empty((phases.size, *polynomial.shape[1:]), precision)
        flat = out.reshape(-1)
        past_caches = out.nbytes > _PAST_CACHES_BYTES
        row = pixels * out.itemsize
        alike = simd.REGISTER_BYTES // math.gcd(simd.REGISTER_BYTES, row) if past_caches else 1
        if phases.size <= _REMEMBERED:  # frames in a row are evaluated at the same phases
            pairs = _paired_before(phases.tobytes(), m, precision, alike)
        else:
            pairs = paired(phases, m, precision, alike)
        rows, waves, centre, mirrored = pairs

        def part(start: int, stop: int) -> None:
            run(order, a, g, scale, rows, waves, centre, flat, start, stop, mirrored, past_caches)

        if phases.size:
            spread(part, pixels)
        return out

    # the first call reads machine code and NumPy's tables, which takes as long as a whole film
    nothing = np.zeros((m + 1, LEAST_PIXELS), f"c{2 * np.dtype(precision).itemsize}")
    lane(nothing, nothing[1:], nothing[0].real, np.arange(_LEAST_MIRRORED))
    return lane
