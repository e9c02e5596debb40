"""Averaging moments over neighbours that agree, see `noise.average_neighbours`."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes, Places, RealPlane, RealPlanes, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.portable import bank, larger, select, smaller, some, tiny
from transientcam_moments.arrays import Length
from transientcam_moments.noise import neighbours

_ROWS = 8  # of a part at least


@njit(nogil=True, error_model="numpy")
def _round(
    parts: Length, turns: RealPlane, given: RealPlanes, current: RealPlanes, weight: RealPlanes,
    present: RealPlane, share: RealPlane, ahead: Places, places: RealPlane, misfit: float, shift:
    float, following: RealPlanes, left: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages over one neighbourhood, and what they leave of the variance.

    Pictures lie flat with a margin between rows; planes of moments hold real and imaginary parts,
    those given times the frames they are the mean of. Where all light comes later by one, a part
    changes by ``turns`` times the other one.
    """
    one = simd.ones(present, 1)
    size = len(parts) + 1
    own, w, late = bank(one, parts, 1), bank(one, parts, 1), bank(one, parts, 1)
    mean = bank(one, parts, 1)
    for p in range(start, stop, simd.width(one)):
        norm, there = 0.0 * one, simd.load(one, present, p)
        for j in range(size):
            own[j], mean[j] = simd.load(one, current[j], p), simd.load(one, given[j], p)
            w[j] = simd.load(one, weight[j >> 1], p)
            late[j] = turns[j] * w[j] * simd.load(one, current[j ^ 1], p)
            norm = norm + turns[j] * turns[j] * w[j] * own[j] * own[j]
        total, square = there, there
        worth = 1.0 / simd.load(one, share, p)
        of_shift, of_misfit = shift * worth / larger(norm, tiny(one)), misfit * worth
        for k in range(len(ahead)):
            a, c = p + ahead[k], p - ahead[k]
            by_a, by_c = simd.load(one, present, a), simd.load(one, present, c)
            ss, dd, ts, td = 0.0 * one, 0.0 * one, 0.0 * one, 0.0 * one
            for j in range(size):
                at_a, at_c = simd.load(one, current[j], a), simd.load(one, current[j], c)
                at_c = select(by_c > 0.0, at_c, at_a)
                at_a = select(by_a > 0.0, at_a, at_c)
                off, half = own[j] - 0.5 * (at_a + at_c), at_c - at_a
                ss, dd = ss + w[j] * off * off, dd + w[j] * half * half
                ts, td = ts + late[j] * off, td + late[j] * half
            ss = ss + neighbours.MISFIT_OF_ONE * (ss + 0.25 * dd)
            ts = ts * ts + neighbours.SHIFT_OF_ONE * (ts * ts + 0.25 * td * td)
            agree = 2.0 - larger(of_misfit * ss, of_shift * ts)
            agree = places[k] * smaller(larger(agree, 0.0 * one), one)
            for j in range(size):
                both = simd.load(one, given[j], a) + simd.load(one, given[j], c)
                mean[j] = mean[j] + agree * both
            total, square = total + agree * (by_a + by_c), square + agree * agree * (by_a + by_c)
        inverse = 1.0 / larger(total, tiny(one))
        for j in range(size):
            simd.store(following[j], p, mean[j] * inverse)
        simd.store(left, p, select(there > 0.0, there * square * inverse * inverse, one))


@njit(nogil=True, error_model="numpy")
def _join(
    parts: Length, turns: RealPlane, raw: RealPlanes, current: RealPlanes, weight: RealPlanes,
    present: RealPlane, share: RealPlane, beside: Places, misfit: float, following: RealPlanes,
    left: RealPlane, late: RealPlane, known: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages as `_joined` has them, what they leave, and residuals by `_averaged`."""
    one = simd.ones(present, 1)
    size = len(parts) + 1
    mean, near, w = bank(one, parts, 1), bank(one, parts, 1), bank(one, parts, 1)
    for p in range(start, stop, simd.width(one)):
        there, own = simd.load(one, present, p), simd.load(one, share, p)
        lone = select(own > neighbours.LONE, there, 0.0 * one)
        own = own / larger(there, tiny(one))
        best, allowed = own, there
        for j in range(size):
            mean[j], w[j] = simd.load(one, current[j], p), simd.load(one, weight[j >> 1], p)
        for k in range(0, len(beside), 2):
            if k == 2 * neighbours.OPPOSITE:
                allowed = select(best < own, 0.0 * one, lone)
            a, c = p + beside[k], p + beside[k + 1]
            its = simd.load(one, share, a) / larger(simd.load(one, present, a), tiny(one))
            its = its + simd.load(one, share, c) / larger(simd.load(one, present, c), tiny(one))
            its = 0.5 * its
            fits = select(its < best, allowed, 0.0 * one)
            if not some(fits > 0.0):
                continue
            square, later, norm = 0.0 * one, 0.0 * one, 0.0 * one
            for j in range(size):
                near[j] = 0.5 * (simd.load(one, current[j], a) + simd.load(one, current[j], c))
            for j in range(size):
                off = simd.load(one, current[j], p) - near[j]
                square = square + w[j] * off * off
                later = later + turns[j] * w[j] * near[j ^ 1] * off
                norm = norm + turns[j] * turns[j] * w[j] * near[j] * near[j]
            noise = there * (own + its)
            fits = select(misfit * square < noise, fits, 0.0 * one)
            noise = neighbours.OF_NOISE * neighbours.OF_NOISE * noise * norm
            fits = select(later * later < noise, fits, 0.0 * one)
            best = select(fits > 0.0, its, best)
            for j in range(size):
                mean[j] = select(fits > 0.0, near[j], mean[j])
        by, of = 0.0 * one, 0.0 * one
        for j in range(size):
            simd.store(following[j], p, mean[j])
            by = by + turns[j] * w[j] * mean[j ^ 1] * simd.load(one, raw[j], p)
            of = of + turns[j] * turns[j] * w[j] * mean[j] * mean[j]
        simd.store(late, p, by)
        simd.store(known, p, of)
        simd.store(left, p, select(there > 0.0, there * best, one))


@njit(nogil=True, error_model="numpy")
def _take_back(
    parts: Length, turns: RealPlane, current: RealPlanes, share: RealPlane, late: RealPlane, known:
    RealPlane, lines: Places, following: RealPlanes, left: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages with what is clearly flattened taken back, and what is left of variance."""
    one = simd.ones(late, 1)
    for p in range(start, stop, simd.width(one)):
        clearest, shift, whole = 0.0 * one, 0.0 * one, tiny(one)
        for line in range(0, len(lines), 9):  # of nine pixels each
            by, of = 0.0 * one, 0.0 * one
            for k in range(line, line + 9):
                by = by + simd.load(one, late, p + lines[k])
                of = of + simd.load(one, known, p + lines[k])
            clear = by * by / larger(of, tiny(one))
            better, clearest = clear > clearest, larger(clear, clearest)
            shift, whole = select(better, by, shift), select(better, of, whole)
        back = clearest > neighbours.CLEAR
        shift = select(back, shift / whole, 0.0 * one)
        doubt = larger(clearest - neighbours.EXPECTED, 0.0 * one)
        doubt = select(back, 0.0 * one + neighbours.OF_CHOICE, doubt)
        doubt = simd.load(one, share, p) + doubt * simd.load(one, known, p) / whole
        simd.store(left, p, smaller(doubt, one))
        for j in range(len(parts) + 1):
            turned = turns[j] * shift * simd.load(one, current[j ^ 1], p)
            simd.store(following[j], p, simd.load(one, current[j], p) + turned)


def neighbours_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile averaging over neighbours of order m; see the table in ``_kernels``."""
    parts = (0,) * (2 * m + 1)
    kernels = (entry(each, m, precision, parts=len(parts)) for each in (_round, _join, _take_back))
    average, join, take_back = kernels

    def kernel(
        raw: Complexes,
        weight: Reals,
        present: RealPlane,
        multiples: tuple[int, ...],
        numbers: float,
        *,
        spread: Spread = at_once,
    ) -> Any:
        height, width = raw.shape[1:]
        row = width + neighbours.REACH  # a margin between rows serves both of them
        first = neighbours.REACH * (row + 1)
        length = 2 * first + height * row + LEAST_PIXELS

        def room(planes: int) -> Any:
            return np.zeros((planes, length), np.float32)

        def picture(flat: Any) -> Any:
            """Return the view of flat planes that is the picture."""
            return flat[..., first : first + height * row].reshape(-1, height, row)[..., :width]

        def over_rows(run: Callable[..., Any], *given: Any) -> None:
            def part(top: int, end: int) -> None:
                run(parts, turns, *given, first + top * row, first + end * row)

            spread(part, height, _ROWS)

        turns = np.outer(multiples, (-1, 1)).ravel().astype(np.float32)
        own, other, spare, weights = (room(each) for each in (*(turns.size,) * 3, len(raw)))
        there, share, left, late, known = room(5)
        share[:], left[:], current = 1, 1, own

        def take_in(top: int, end: int) -> None:
            rows, view = np.s_[:, top:end], picture(own)
            view[0::2][rows], view[1::2][rows] = raw.real[rows], raw.imag[rows]
            picture(weights)[rows], picture(there)[0, top:end] = weight[rows], present[top:end]

        spread(take_in, height, _ROWS)
        whole = ((present == 0) | (present == 1)).all()  # frames, and 0 elsewhere
        given = own if whole else own * there
        for radius_px in neighbours.RADII_PX:
            near = neighbours.neighbourhood(radius_px)
            ahead = np.array([dy * row + dx for dy, dx, _ in near])
            places = np.array([place for *_, place in near], np.float32)
            limits = 1 / (neighbours.MOST_MISFIT * float(numbers)), 2 / neighbours.MOST_SHIFT
            rest = weights, there, share, ahead, places, *limits
            over_rows(average, given, current, *rest, other, left)
            current, other = other, spare if current is own else current
            share, left = left, share
        misfit = 1 / (float(numbers) + neighbours.OF_NOISE * (2 * float(numbers)) ** 0.5)
        beside, lines = (np.ravel(at @ (row, 1)) for at in (neighbours.BESIDE, neighbours.LINES))
        over_rows(
            join, own, current, weights, there, share, beside, misfit, other, left, late, known
        )
        over_rows(take_back, other, left, late, known, lines, current, share)
        moments, view = np.empty(raw.shape, np.complex64), picture(current)
        moments.real, moments.imag = view[0::2], view[1::2]
        return moments, np.ascontiguousarray(picture(share)[0])

    return kernel
