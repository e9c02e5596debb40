"""Pisarenko's returns of every pixel."""

from collections.abc import Callable
from typing import Any

import numpy as np

from transientcam_compiled import Spread, at_once, blocks, empty
from transientcam_moments._kernels.arrays import Complexes, FlatReturns, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue
from transientcam_moments._kernels.returns import find_returns, usual_steps
from transientcam_moments._kernels.wide import WideReturns
from transientcam_moments.moment_problem import half_turns, redo, sparse

_ROOM = 256  # pixels that are redone in double precision at a time


def pisarenko_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile Pisarenko's returns of order m; see the table in ``_kernels``."""
    order = (0,) * m
    turns = half_turns(m, precision)
    run_eigenvalue = entry(smallest_eigenvalue, m, precision)
    run_returns = entry(find_returns, m, precision)
    wide = WideReturns(m) if precision == "f" else None

    def kernel(
        b: Complexes,
        eigenvalue: Reals | None = None,
        *,
        noise: float | None = None,
        spread: Spread = at_once,
    ) -> tuple[Any, Any, Any, Any]:
        shape, pixels = b.shape[1:], b[0].size
        planes = np.ascontiguousarray(b).reshape(m + 1, pixels)
        uniform = empty(pixels, precision)
        if eigenvalue is not None:
            uniform[:] = eigenvalue.reshape(-1)
        phase, weight = empty((m, pixels), precision), empty((m, pixels), precision)
        count, residual = empty(pixels, np.int32), empty(pixels, precision)
        found = FlatReturns(uniform, phase, weight, count, residual)
        brightness = np.ascontiguousarray(planes[0].real)
        eps = noise or float(np.finfo(precision).eps)
        ill: list[int] = []

        def part(start: int, stop: int) -> None:
            worst = 0
            for left, right in blocks(start, stop):
                if eigenvalue is None:
                    run_eigenvalue(order, planes, 0, uniform, left, right)
                worst += run_returns(
                    order, turns, planes, uniform, 0, uniform, phase, weight, count, residual,
                    eps, usual_steps(m, precision), left, right,
                )  # fmt: skip
            if worst and wide is not None:
                wide(planes, brightness, found, wide.room(_ROOM), start, stop)
            else:
                ill.append(worst)

        spread(part, pixels)
        if any(ill):
            where = np.flatnonzero(residual > sparse.largest_residual(m, eps))
            redo(planes, (phase, weight, uniform, count), where, eps)
        return (
            phase.reshape((m, *shape)),
            weight.reshape((m, *shape)),
            uniform.reshape(shape),
            count.reshape(shape),
        )

    return kernel
