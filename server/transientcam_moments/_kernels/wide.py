"""Returns that single precision is not enough for, compiled in double precision."""

from typing import Any

import numpy as np

from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import outputs
from transientcam_moments._kernels.arrays import Complexes, FlatReturns, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue
from transientcam_moments._kernels.padding import RAMP
from transientcam_moments._kernels.returns import MOST_STEPS, find_returns
from transientcam_moments.moment_problem import half_turns, redo, sparse

_EPS = float(np.finfo(np.float32).eps)


class WideReturns:
    """Redoes the pixels of order m that do not reproduce their moments.

    Several threads may call it at once, each with a room of its own.
    """

    def __init__(self, m: int) -> None:
        self._order = (0,) * m
        self._turns = half_turns(m, "d")
        self._gather = entry(outputs.gather, m, "f")
        self._scatter = entry(outputs.scatter, m, "f")
        self._eigenvalue = entry(smallest_eigenvalue, m, "d")
        self._returns = entry(find_returns, m, "d")

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
