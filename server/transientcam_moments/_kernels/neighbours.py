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
from transientcam_moments.arrays import Length, Plane
from transientcam_moments.noise import neighbours

_ROWS = 8  # of a part at least


@njit(forceinline=True, error_model="numpy")
def _agreement(place: float, doubt: Plane) -> Any:
    return place * smaller(larger(2.0 - doubt, 0.0 * doubt), 0.0 * doubt + 1.0)


@njit(forceinline=True, error_model="numpy")
def _weighed(plane: RealPlane, a: int, weight: Plane, c: int) -> Any:
    return weight * (simd.load(weight, plane, a) + simd.load(weight, plane, c))


@njit(nogil=True, error_model="numpy")
def _round(
    order: Length, multiples: RealPlane, given: RealPlanes, current: RealPlanes, weight: RealPlanes,
    present: RealPlane, share: RealPlane, ahead: Places, places: RealPlane, misfit: float, shift:
    float, following: RealPlanes, left: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages over one neighbourhood, and what they leave of the variance.

    Pictures lie flat with a margin between rows; planes of moments hold real and imaginary parts,
    those given times the frames they are the mean of.
    """
    one = simd.ones(present, 1)
    size = len(order) + 1
    er, ei, w = bank(one, order, 1), bank(one, order, 1), bank(one, order, 1)
    tr, ti = bank(one, order, 1), bank(one, order, 1)
    mr, mi = bank(one, order, 1), bank(one, order, 1)
    for p in range(start, stop, simd.width(one)):
        norm = 0.0 * one
        there = simd.load(one, present, p)
        for j in range(size):
            er[j], ei[j] = simd.load(one, current[2 * j], p), simd.load(one, current[2 * j + 1], p)
            mr[j], mi[j] = simd.load(one, given[2 * j], p), simd.load(one, given[2 * j + 1], p)
            w[j] = simd.load(one, weight[j], p)
            tr[j], ti[j] = multiples[j] * w[j] * er[j], multiples[j] * w[j] * ei[j]
            norm = norm + multiples[j] * tr[j] * er[j]
            norm = norm + multiples[j] * ti[j] * ei[j]
        total, square = there, there
        worth = 1.0 / simd.load(one, share, p)
        of_shift, of_misfit = shift * worth / larger(norm, tiny(one)), misfit * worth
        for k in range(len(ahead)):
            a, c = p + ahead[k], p - ahead[k]
            # off the mean of both, and either off it
            ss, dd, ts, td = 0.0 * one, 0.0 * one, 0.0 * one, 0.0 * one
            for j in range(size):
                ar, ai = simd.load(one, current[2 * j], a), simd.load(one, current[2 * j + 1], a)
                cr, ci = simd.load(one, current[2 * j], c), simd.load(one, current[2 * j + 1], c)
                sr, si = er[j] - 0.5 * (ar + cr), ei[j] - 0.5 * (ai + ci)
                dr, di = cr - ar, ci - ai
                ss = ss + w[j] * sr * sr
                ss = ss + w[j] * si * si
                dd = dd + w[j] * dr * dr
                dd = dd + w[j] * di * di
                ts = ts + tr[j] * si
                ts = ts - ti[j] * sr
                td = td + tr[j] * di
                td = td - ti[j] * dr
            by_a, by_c = simd.load(one, present, a), simd.load(one, present, c)
            dd, td, ts2 = 0.25 * dd, 0.5 * td, larger(ts * ts, 0.0 * one)
            both = ss + neighbours.MISFIT_OF_ONE * (ss + dd)
            mirrored = ts2 + neighbours.SHIFT_OF_ONE * (ts2 + td * td)
            of_a = larger(of_misfit * both, of_shift * mirrored)
            of_c = of_a
            if some(smaller(by_a, by_c) <= 0.0):
                uu, vv, tu, tv = 0.0 * one, 0.0 * one, 0.0 * one, 0.0 * one
                for j in range(size):
                    ur = er[j] - simd.load(one, current[2 * j], a)
                    ui = ei[j] - simd.load(one, current[2 * j + 1], a)
                    vr = er[j] - simd.load(one, current[2 * j], c)
                    vi = ei[j] - simd.load(one, current[2 * j + 1], c)
                    uu, vv = uu + w[j] * ur * ur, vv + w[j] * vr * vr
                    uu, vv = uu + w[j] * ui * ui, vv + w[j] * vi * vi
                    tu, tv = tu + tr[j] * ui, tv + tr[j] * vi
                    tu, tv = tu - ti[j] * ur, tv - ti[j] * vr
                alone, later = 1.0 + neighbours.MISFIT_OF_ONE, 1.0 + neighbours.SHIFT_OF_ONE
                tu, tv = later * tu * tu, later * tv * tv
                of_a = select(
                    by_c > 0.0, of_a, larger(of_misfit * (alone * uu), of_shift * tu)
                )
                of_c = select(
                    by_a > 0.0, of_c, larger(of_misfit * (alone * vv), of_shift * tv)
                )
            sa, sc = _agreement(places[k], of_a), _agreement(places[k], of_c)
            for j in range(size):
                mr[j] = mr[j] + sa * simd.load(one, given[2 * j], a)
                mr[j] = mr[j] + sc * simd.load(one, given[2 * j], c)
                mi[j] = mi[j] + sa * simd.load(one, given[2 * j + 1], a)
                mi[j] = mi[j] + sc * simd.load(one, given[2 * j + 1], c)
            total = total + by_a * sa
            total = total + by_c * sc
            square = square + by_a * (sa * sa)
            square = square + by_c * (sc * sc)
        inverse = 1.0 / larger(total, tiny(one))
        for j in range(size):
            simd.store(following[2 * j], p, mr[j] * inverse)
            simd.store(following[2 * j + 1], p, mi[j] * inverse)
        simd.store(left, p, select(there > 0.0, there * square * inverse * inverse, one))


@njit(nogil=True, error_model="numpy")
def _join(
    order: Length, multiples: RealPlane, raw: RealPlanes, current: RealPlanes, weight: RealPlanes,
    present: RealPlane, share: RealPlane, beside: Places, misfit: float, following: RealPlanes,
    left: RealPlane, late: RealPlane, known: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages as `_joined` has them, what they leave, and residuals by `_averaged`."""
    one = simd.ones(present, 1)
    size = len(order) + 1
    er, ei, w = bank(one, order, 1), bank(one, order, 1), bank(one, order, 1)
    mr, mi = bank(one, order, 1), bank(one, order, 1)
    nr, ni = bank(one, order, 1), bank(one, order, 1)
    most = neighbours.OF_NOISE * neighbours.OF_NOISE
    for p in range(start, stop, simd.width(one)):
        there, own = simd.load(one, present, p), simd.load(one, share, p)
        lone = select(own > neighbours.LONE, there, 0.0 * one)
        own = own / larger(there, tiny(one))
        best, allowed = own, there
        for j in range(size):
            er[j], ei[j] = simd.load(one, current[2 * j], p), simd.load(one, current[2 * j + 1], p)
            mr[j], mi[j], w[j] = er[j], ei[j], simd.load(one, weight[j], p)
        for k in range(0, len(beside), 2):
            if k == 2 * neighbours.OPPOSITE:
                allowed = select(best < own, 0.0 * one, lone)
                if not some(allowed > 0.0):
                    break
            a, c = p + beside[k], p + beside[k + 1]
            its = simd.load(one, share, a) / larger(simd.load(one, present, a), tiny(one))
            its = its + simd.load(one, share, c) / larger(simd.load(one, present, c), tiny(one))
            its = 0.5 * its
            better = select(its < best, allowed, 0.0 * one)
            if not some(better > 0.0):
                continue
            square, later, norm = 0.0 * one, 0.0 * one, 0.0 * one
            for j in range(size):
                nr[j] = _weighed(current[2 * j], a, 0.5 * one, c)
                ni[j] = _weighed(current[2 * j + 1], a, 0.5 * one, c)
                dr, di = er[j] - nr[j], ei[j] - ni[j]
                tr, ti = multiples[j] * w[j] * nr[j], multiples[j] * w[j] * ni[j]
                square = square + w[j] * dr * dr
                square = square + w[j] * di * di
                later = later + tr * di
                later = later - ti * dr
                norm = norm + multiples[j] * tr * nr[j]
                norm = norm + multiples[j] * ti * ni[j]
            noise = there * (own + its)
            better = select(misfit * square < noise, better, 0.0 * one)
            fits = select(later * later < most * noise * norm, better, 0.0 * one) > 0.0
            best = select(fits, its, best)
            for j in range(size):
                mr[j], mi[j] = select(fits, nr[j], mr[j]), select(fits, ni[j], mi[j])
        by, of = 0.0 * one, 0.0 * one
        for j in range(size):
            simd.store(following[2 * j], p, mr[j])
            simd.store(following[2 * j + 1], p, mi[j])
            rr, ri = simd.load(one, raw[2 * j], p), simd.load(one, raw[2 * j + 1], p)
            tr, ti = multiples[j] * w[j] * mr[j], multiples[j] * w[j] * mi[j]
            by = by + tr * ri
            by = by - ti * rr
            of = of + multiples[j] * tr * mr[j]
            of = of + multiples[j] * ti * mi[j]
        simd.store(late, p, by)
        simd.store(known, p, of)
        simd.store(left, p, select(there > 0.0, there * best, one))


@njit(nogil=True, error_model="numpy")
def _take_back(
    order: Length, multiples: RealPlane, current: RealPlanes, share: RealPlane, late: RealPlane,
    known: RealPlane, lines: Places, following: RealPlanes, left: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages with what is clearly flattened taken back, and what is left of variance."""
    one = simd.ones(late, 1)
    for p in range(start, stop, simd.width(one)):
        clearest, shift, whole = 0.0 * one, 0.0 * one, 0.0 * one
        for line in range(0, len(lines), 9):  # of nine pixels each
            by, of = 0.0 * one, 0.0 * one
            for k in range(line, line + 9):
                by = by + simd.load(one, late, p + lines[k])
                of = of + simd.load(one, known, p + lines[k])
            clear = by * by / larger(of, tiny(one))
            better, clearest = clear > clearest, larger(clear, clearest)
            shift, whole = select(better, by, shift), select(better, of, whole)
        back, whole = clearest > neighbours.CLEAR, larger(whole, tiny(one))
        shift = select(back, shift / whole, 0.0 * one)
        doubt = larger(clearest - neighbours.EXPECTED, 0.0 * one)
        doubt = select(back, 0.0 * one + neighbours.OF_CHOICE, doubt)
        doubt = simd.load(one, share, p) + doubt * simd.load(one, known, p) / whole
        simd.store(left, p, smaller(doubt, one))
        for j in range(len(order) + 1):
            turned = multiples[j] * shift
            er, ei = simd.load(one, current[2 * j], p), simd.load(one, current[2 * j + 1], p)
            simd.store(following[2 * j], p, er - turned * ei)
            simd.store(following[2 * j + 1], p, ei + turned * er)


def neighbours_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile averaging over neighbours of order m; see the table in ``_kernels``."""
    order = (0,) * m
    average, join, take_back = (entry(each, m, precision) for each in (_round, _join, _take_back))

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
                run(order, orders, *given, first + top * row, first + end * row)

            spread(part, height, _ROWS)

        planes, orders = 2 * len(raw), np.array(multiples, np.float32)
        own, other, spare, weights = room(planes), room(planes), room(planes), room(len(raw))
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
        beside, lines = ((each @ (row, 1)).ravel() for each in (neighbours.BESIDE, neighbours.LINES))
        rest = weights, there, share, beside, misfit
        over_rows(join, own, current, *rest, other, left, late, known)
        over_rows(take_back, other, left, late, known, lines, current, share)
        moments, final = np.empty(raw.shape, np.complex64), np.empty((height, width), np.float32)

        def give_out(top: int, end: int) -> None:
            rows, view = np.s_[:, top:end], picture(current)
            moments.real[rows], moments.imag[rows] = view[0::2][rows], view[1::2][rows]
            final[top:end] = picture(share)[0, top:end]

        spread(give_out, height, _ROWS)
        return moments, final

    return kernel
