"""Eq. (2) for many pixels and phases: one pass over blocks of pixels that stay in cache."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import (
    Complexes,
    ComplexPlanes,
    RealPlane,
    RealPlanes,
    Reals,
    Table,
)
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.phase_groups import ANY, MIRRORED, TURN, grouping
from transientcam_moments._kernels.portable import bank, eps
from transientcam_moments.arrays import Bank, Length, Plane
from transientcam_moments.moment_problem import evaluation, toeplitz

_BANK = 240  # pairs of registers of coefficients, which stay in the first cache for all phases
_PAST_CACHES_BYTES = 1 << 24
# four phases of a turn take 14 registers at a time, and twice as many where there are enough
_TOGETHER = simd.REGISTERS // 16
_LANES = _BANK * 2 // _TOGETHER
# what fills a line in parts must do so at once: others may be written before it is whole
_IN_PARTS = simd.REGISTER_BYTES < simd.LINE_BYTES
_UNIT = 64  # pixels: a line of memory and more
_PARTS_EACH = 4  # of a film for each thread: the other may be late


@njit(forceinline=True, error_model="numpy")
def _load(order: Length, q: Bank, pitch: int, at: int, u: Bank, v: Bank) -> Any:
    """Load what `_fill` put into a bank for some pixels."""
    for j in range(len(order)):
        u[j] = simd.load_within(q, (2 * j + 2) * pitch + at)
        v[j] = simd.load_within(q, (2 * j + 3) * pitch + at)
    return simd.load_within(q, at), simd.load_within(q, pitch + at)


@njit(forceinline=True, error_model="numpy")
def _write(out: Reals, place: int, value: Plane, past_caches: bool) -> None:
    if past_caches:
        simd.stream(out, place, value)
    else:
        simd.store(out, place, value)


@njit(forceinline=True, error_model="numpy")
def _put(
    out: Reals, place: int, stage: Bank, at: int, value: Plane, how: tuple[bool, bool]
) -> None:
    """Write to ``at`` of the stage, if there is one, or else to ``place`` of the results."""
    staged, past_caches = how
    if staged:
        simd.store_within(stage, at, value)
    else:
        _write(out, place, value, past_caches)


@njit(forceinline=True, error_model="numpy")
def _write_row(
    out: Reals, row: int, stage: Bank, at: int, first: int, end: int, one: Plane, step: int
) -> None:
    """Write what the stage holds from ``at`` on to the pixels first..end of a row, at once."""
    for i in range(first, end, step):
        p = max(0, min(i, end - step))
        for part in range(0, step, simd.width(one)):
            lanes = simd.load_within(stage, at + i - first + part)
            _write(out, row + p + part, lanes, p == i)


@njit(forceinline=True, error_model="numpy")
def _fill(
    order: Length, polynomial: Complexes, reflection: Complexes, error: Reals, centre: Reals,
    turned: bool, one: Plane, q: Bank, pitch: int, shift: int, left: int, held: int,
) -> None:  # fmt: skip
    """Put what Eq. (2) needs of pixels from ``left`` on into a bank, from ``shift`` on."""
    m, step = len(order), simd.width(one)
    for i in range(0, held, step):
        p = min(i, held - step)
        at = p + shift
        simd.store_within(q, at, simd.load(one, error, left + p) * (0.5 / np.pi))
        least = eps(one)
        for j in range(m):
            re, im = simd.load_complex(one, polynomial[j + 1], left + p)
            if turned:  # conj(a_j) exp(i j centre)
                c, s = simd.spread(one, centre[j]), simd.spread(one, centre[m + j])
                re, im = evaluation.turned(re, im, c, s)
            simd.store_within(q, (2 * j + 2) * pitch + at, re)
            simd.store_within(q, (2 * j + 3) * pitch + at, im)
            re, im = simd.load_complex(one, reflection[j], left + p)
            least = least * toeplitz.below_one(re, im)  # eps E / b_0
        simd.store_within(q, pitch + at, least)


@njit(nogil=True, error_model="numpy")
def _density(
    order: Length,
    polynomial: ComplexPlanes,
    reflection: ComplexPlanes,
    error: RealPlane,
    rows: Table,
    waves: RealPlanes,
    centre: RealPlane,
    out: RealPlane,
    start: int,
    stop: int,
    together: int,
    past_caches: bool,
) -> None:
    """Write the density at phases in groups into ``out`` (T * P) for the pixels start..stop.

    ``together`` is ANY, MIRRORED or TURN of `Groups`, which says what ``rows``, ``waves`` and
    ``centre`` hold.

    ``past_caches``, whole lines of memory are written at a time: each row begins at its own first
    line, where all of a group begin alike. The bank is filled so that what is written to a line of
    the first row lies in a line, too: loads across lines take twice as long. Where a register is
    less than a line, the rows of a group wait on a stage for the whole block and are then written
    one after another.
    """
    m = len(order)
    one = simd.ones(error, _TOGETHER)
    step = 2 // _TOGETHER * simd.width(one)
    pitch = _BANK // (2 * m + 2) * step
    # rows that begin at a line of memory reach into the next block or part, which begins at its own
    block = pitch - 2 * step if past_caches else pitch
    pixels = error.shape[0]
    q = bank(one, (), _LANES)
    stage = bank(one, (), _LANES)
    staged = past_caches and _IN_PARTS
    c0, s0 = bank(one, order, 0), bank(one, order, 0)
    c1, s1 = bank(one, order, 0), bank(one, order, 0)
    u, v = bank(one, order, 0), bank(one, order, 0)
    left = start
    while left < stop:
        left = min(left, stop - step)
        size = min(block, stop - left)
        held = min(size + step, pixels - left) if past_caches else size
        shift = 0
        if past_caches:
            shift = step - simd.before_boundary(out, rows[0, 0] * pixels + left)
        _fill(
            order, polynomial, reflection, error, centre, together != ANY,
            one, q, pitch, shift, left, held,
        )  # fmt: skip
        for group in range(waves.shape[0]):
            wave = waves[group]
            for j in range(m):
                c0[j], s0[j] = simd.spread(one, wave[j]), simd.spread(one, wave[m + j])
                c1[j] = simd.spread(one, wave[2 * m + j])
                s1[j] = simd.spread(one, wave[3 * m + j])
            r0, r1 = rows[group, 0] * pixels + left, rows[group, 1] * pixels + left
            r2, r3 = rows[group, 2] * pixels + left, rows[group, 3] * pixels + left
            begin, first, end = 0, 0, size
            if past_caches:
                begin = simd.before_boundary(out, r0)
                end = min(size + begin, held)
                # what lies before the first line belongs to the block or part before
                first = begin - step if left == 0 and begin > 0 else begin
            for i in range(first, end, step):
                p = max(0, min(i, end - step))
                how = staged, past_caches and p == i
                for part in range(0, step, simd.width(one)):
                    at, to, x = p + shift + part, p + part, i - first + part
                    scale, least = _load(order, q, pitch, at, u, v)
                    if together == TURN:
                        h0, h1, h2, h3 = evaluation.four_of_a_turn(
                            order, one, scale, least, u, v, c0, s0
                        )
                        _put(out, r3 + to, stage, x + 3 * pitch, h3, how)
                        _put(out, r2 + to, stage, x + 2 * pitch, h2, how)
                    elif together == MIRRORED:
                        h0, h1 = evaluation.mirrored_two(order, one, scale, least, u, v, c0, s0)
                    else:
                        h0, h1 = evaluation.any_two(order, scale, least, u, v, c0, s0, c1, s1)
                    _put(out, r1 + to, stage, x + pitch, h1, how)
                    _put(out, r0 + to, stage, x, h0, how)
            if staged:
                # the first one last: it is right where the row of another is the same
                for k in range(3 if together == TURN else 1, -1, -1):
                    row = rows[group, k] * pixels + left
                    _write_row(out, row, stage, k * pitch, first, end, one, step)
        left += size
    if past_caches:
        simd.fence()


def density_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the density of order m; see the table in ``_kernels`` for what it takes."""
    order = (0,) * m
    run = entry(_density, m, precision)
    grouped = grouping(m, precision)

    def kernel(
        polynomial: Complexes,
        reflection: Complexes,
        error: Reals,
        phase_rad: Reals,
        out: Reals | None = None,
        *,
        spread: Spread = at_once,
    ) -> Any:
        pixels = polynomial[0].size
        a = np.ascontiguousarray(polynomial).reshape(m + 1, pixels)
        g = np.ascontiguousarray(reflection).reshape(m, pixels)
        scale = np.ascontiguousarray(error).reshape(pixels)
        phases = np.asarray(phase_rad, np.float64)
        if out is None:
            out = empty((phases.size, *polynomial.shape[1:]), precision)
        flat = out.reshape(-1)
        past_caches = out.nbytes > _PAST_CACHES_BYTES
        row = pixels * out.itemsize
        alike = simd.LINE_BYTES // math.gcd(simd.LINE_BYTES, row) if past_caches else 1
        rows, waves, centre, together = grouped(phases, alike)

        def part(start: int, stop: int) -> None:
            run(order, a, g, scale, rows, waves, centre, flat, start, stop, together, past_caches)

        if phases.size:
            spread(part, pixels, _UNIT, _PARTS_EACH if past_caches else 1)
        return out

    # the first call reads machine code and NumPy's tables, which takes as long as a whole film
    nothing = np.zeros((m + 1, LEAST_PIXELS), f"c{2 * np.dtype(precision).itemsize}")
    kernel(nothing, nothing[1:], nothing[0].real, np.arange(8.0))
    return kernel
