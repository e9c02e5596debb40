"""Returns that single precision is not enough for, compiled in double precision."""

from typing import Any

import numpy as np

from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import outputs
from transientcam_moments._kernels.arrays import Complexes, FlatReturns, Reals
from transientcam_moments._kernels.compiled_entry import (
    COUNTS,
    PIXELS,
    PLACES,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.eigenvalue import eigenvalue_entry
from transientcam_moments._kernels.padding import RAMP
from transientcam_moments._kernels.returns import MOST_STEPS, returns_entry
from transientcam_moments.moment_problem import half_turns, redo, sparse

_EPS = float(np.finfo(np.float32).eps)


class WideReturns:
    """Redoes the pixels of order m that do not reproduce their moments.

    Several threads may call it at once, each with a room of its own.
    """

    def __init__(self, m: int) -> None:
        order, plane, planes = order_type(m), real_arrays("f")[1], real_arrays("f")[2]
        wide = real_arrays("d")
        self._order = (0,) * m
        self._turns = half_turns(m, "d")
        self._gather = entry(
            outputs.gather,
            order, complex_arrays("f")[2], plane, plane, REAL, plane, plane,
            complex_arrays("d")[2], PLACES, PIXELS,
        )  # fmt: skip
        self._scatter = entry(
            outputs.scatter,
            order, PLACES, PIXELS, wide[2], wide[2], COUNTS, wide[1],
            planes, planes, COUNTS, plane,
        )  # fmt: skip
        self._eigenvalue, self._returns = eigenvalue_entry(m, "d"), returns_entry(m, "d")

    def room(self, pixels: int) -> tuple[Any, ...]:
        """Return scratch space for so many pixels at a time, a multiple of LEAST_PIXELS."""
        m = len(self._order)
        return (
            np.empty(pixels, np.int64),
            np.empty((m + 1, pixels), np.complex128),
            np.empty(pixels),
            np.empty((m, pixels)),
            np.empty((m, pixels)),
            np.empty(pixels, np.int32),
            np.empty(pixels),
            np.empty(LEAST_PIXELS, np.float32),
        )

    def __call__(
        self,
        b: Complexes,
        brightness: Reals,
        found: FlatReturns,
        room: tuple[Any, ...],
        start: int,
        stop: int,
    ) -> int:
        """Redo what is wrong among the pixels start..stop; return how many were.

        ``b`` (m + 1, P) are the moments, but for ``brightness`` (P) in place of b_0.
        """
        tolerance = sparse.largest_residual(len(self._order), _EPS)
        places, moments, uniform, phase, weight, count, residual, packed = room
        redone = 0
        while True:
            number = self._gather(
                self._order, b, brightness, found.residual[:stop], tolerance, RAMP, packed,
                moments, places, start,
            )  # fmt: skip
            if not number:
                return redone
            end = -(-number // LEAST_PIXELS) * LEAST_PIXELS
            self._eigenvalue(self._order, moments, 0, uniform, 0, end)
            ill = self._returns(
                self._order, self._turns, moments, uniform, 0, uniform, phase, weight, count,
                residual, _EPS, MOST_STEPS, 0, end,
            )  # fmt: skip
            if ill:
                where = np.flatnonzero(residual[:end] > tolerance)
                redo(moments, (phase, weight, uniform, count), where, _EPS)
            self._scatter(
                self._order, places, number, phase, weight, count, residual, found.phase,
                found.weight, found.count, found.residual,
            )  # fmt: skip
            if found.uniform is not None:
                found.uniform[places[:number]] = uniform[:number]
            redone += number
            start = int(places[number - 1]) + 1
