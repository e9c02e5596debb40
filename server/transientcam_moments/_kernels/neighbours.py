"""Averaging moments over neighbours that agree, see `noise.average_neighbours`."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes, Places, RealPlane, RealPlanes, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.portable import bank, larger, select, smaller, tiny
from transientcam_moments.arrays import Length, Plane
from transientcam_moments.noise import neighbours

_ROWS = 8  # of a part at least


@njit(forceinline=True, error_model="numpy")
def _agreement(place: float, doubt: Plane) -> Any:
    return place * smaller(larger(2.0 - doubt, 0.0 * doubt), 0.0 * doubt + 1.0)


@njit(forceinline=True, error_model="numpy")
def _weighed(plane: RealPlane, a: int, wa: Plane, c: int, wc: Plane) -> Any:
    return wa * simd.load(wa, plane, a) + wc * simd.load(wc, plane, c)


@njit(nogil=True, error_model="numpy")
def _round(
    order: Length, multiples: RealPlane, raw: RealPlanes, current: RealPlanes, weight: RealPlanes,
    present: RealPlane, share: RealPlane, ahead: Places, places: RealPlane, misfit: float, shift:
    float, following: RealPlanes, left: RealPlane, start: int, stop: int,
) -> None:  # fmt: skip
    """Write averages over one neighbourhood, and what they leave of the variance.

    Pictures lie flat with a margin between rows; planes of moments hold real and imaginary parts.
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
            mr[j] = there * simd.load(one, raw[2 * j], p)
            mi[j] = there * simd.load(one, raw[2 * j + 1], p)
            w[j] = simd.load(one, weight[j], p)
            tr[j], ti[j] = multiples[j] * w[j] * er[j], multiples[j] * w[j] * ei[j]
            norm = norm + multiples[j] * (tr[j] * er[j] + ti[j] * ei[j])
        total, square = there, there
        worth = 1.0 / simd.load(one, share, p)
        of_shift, of_misfit = shift * worth / larger(norm, tiny(one)), misfit * worth
        for k in range(len(ahead)):
            a, c = p + ahead[k], p - ahead[k]
            uu, vv, uv = 0.0 * one, 0.0 * one, 0.0 * one
            tu, tv = 0.0 * one, 0.0 * one
            for j in range(size):
                ur = er[j] - simd.load(one, current[2 * j], a)
                ui = ei[j] - simd.load(one, current[2 * j + 1], a)
                vr = er[j] - simd.load(one, current[2 * j], c)
                vi = ei[j] - simd.load(one, current[2 * j + 1], c)
                wr, wi = w[j] * ur, w[j] * ui
                uu = uu + wr * ur + wi * ui
                uv = uv + wr * vr + wi * vi
                vv = vv + w[j] * (vr * vr + vi * vi)
                tu = tu + (tr[j] * ui - ti[j] * ur)
                tv = tv + (tr[j] * vi - ti[j] * vr)
            by_a, by_c = simd.load(one, present, a), simd.load(one, present, c)
            both, mirrored = 0.25 * (uu + vv) + 0.5 * uv, 0.25 * (tu + tv) * (tu + tv)
            tu, tv = tu * tu, tv * tv
            both = both + 0.5 * neighbours.MISFIT_OF_ONE * (uu + vv)
            mirrored = mirrored + 0.5 * neighbours.SHIFT_OF_ONE * (tu + tv)
            of_a = select(by_c > 0.0, both, (1.0 + neighbours.MISFIT_OF_ONE) * uu)
            of_c = select(by_a > 0.0, both, (1.0 + neighbours.MISFIT_OF_ONE) * vv)
            late_a = select(by_c > 0.0, mirrored, (1.0 + neighbours.SHIFT_OF_ONE) * tu)
            late_c = select(by_a > 0.0, mirrored, (1.0 + neighbours.SHIFT_OF_ONE) * tv)
            sa = _agreement(places[k], larger(of_misfit * of_a, of_shift * late_a))
            sc = _agreement(places[k], larger(of_misfit * of_c, of_shift * late_c))
            wa, wc = by_a * sa, by_c * sc
            for j in range(size):
                mr[j] = mr[j] + _weighed(raw[2 * j], a, wa, c, wc)
                mi[j] = mi[j] + _weighed(raw[2 * j + 1], a, wa, c, wc)
            total = total + (wa + wc)
            square = square + (wa * sa + wc * sc)
        inverse = 1.0 / larger(total, tiny(one))
        for j in range(size):
            simd.store(following[2 * j], p, mr[j] * inverse)
            simd.store(following[2 * j + 1], p, mi[j] * inverse)
        simd.store(left, p, select(there > 0.0, there * square * inverse * inverse, one))


@njit(nogil=True, error_model="numpy")
def _clearest(
    lines: Places, late: RealPlane, known: RealPlane, best: RealPlanes, start: int, stop: int
) -> None:
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
        simd.store(best[0], p, clearest)
        simd.store(best[1], p, shift)
        simd.store(best[2], p, whole)


def neighbours_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile averaging over neighbours of order m; see the table in ``_kernels``."""
    order = (0,) * m
    average, look = entry(_round, m, precision), entry(_clearest, m, precision)

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

        def picture(flat: Any) -> Any:
            """Return the view of flat planes that is the picture."""
            return flat[:, first : first + height * row].reshape(-1, height, row)[..., :width]

        def room(planes: int, fill: float = 0.0) -> tuple[Any, Any]:
            flat = np.full((planes, length), fill, np.float32)
            return flat, picture(flat)

        def over_rows(run: Callable[..., Any]) -> None:
            spread(lambda top, end: run(first + top * row, first + end * row), height, _ROWS)

        given, view = room(2 * len(raw))
        view[0::2], view[1::2] = raw.real, raw.imag
        weights, view = room(len(raw))
        view[...] = weight
        there, view = room(1)
        view[0] = present
        (other, _), (spare, _) = room(2 * len(raw)), room(2 * len(raw))
        (share, _), (left, _) = room(1, 1.0), room(1, 1.0)
        current, orders = given, np.array(multiples, np.float32)
        for radius_px in neighbours.RADII_PX:
            near = neighbours.neighbourhood(radius_px)
            ahead = np.array([dy * row + dx for dy, dx, _ in near])
            places = np.array([place for *_, place in near], np.float32)
            limits = 1 / (neighbours.MOST_MISFIT * float(numbers)), 2 / neighbours.MOST_SHIFT
            planes = given, current, weights, there[0], share[0], ahead, places
            over_rows(partial(average, order, orders, *planes, *limits, other, left[0]))
            current, other = other, spare if current is given else current
            share, left = left, share
        moments, view = np.empty(raw.shape, np.complex64), picture(current)
        moments.real, moments.imag = view[0::2], view[1::2]

        def search(both: Reals) -> Any:
            (planes, view), (best, seen) = room(2), room(3)
            view[...] = both
            over_rows(partial(look, (neighbours.LINES @ (row, 1)).ravel(), *planes, best))
            return seen

        left = np.ascontiguousarray(picture(share)[0])
        return neighbours.finished(raw, moments, left, weight, present, multiples, numbers, search)

    return kernel
