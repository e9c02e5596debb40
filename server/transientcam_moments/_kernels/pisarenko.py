"""Pisarenko's returns of every pixel."""

from collections.abc import Callable
from typing import Any

import numpy as np

from transientcam_moments._kernels.compiled_entry import (
    COUNTS,
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.eigenvalue import eigenvalue_entry
from transientcam_moments._kernels.parallel import Spread, at_once, blocks
from transientcam_moments._kernels.refine import redo
from transientcam_moments._kernels.returns import find_returns


def half_turns(m: int, precision: str) -> Any:
    """Return cos and sin of pi k / m, k < m, one after the other."""
    angle = np.pi * np.arange(m) / m
    return np.concatenate([np.cos(angle), np.sin(angle)]).astype(precision)


def returns_entry(m: int, precision: str) -> Callable[..., Any]:
    """Compile the kernel of order m."""
    real, cplx = real_arrays(precision), complex_arrays(precision)
    return entry(
        find_returns,
        order_type(m),
        real[1],
        cplx[2],
        real[1],
        PIXELS,
        real[1],
        real[2],
        real[2],
        COUNTS,
        real[1],
        REAL,
        PIXELS,
        PIXELS,
    )


def pisarenko_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile Pisarenko's returns of order m; see the table in ``_kernels``."""
    order = (0,) * m
    turns = half_turns(m, precision)
    run_eigenvalue, run_returns = eigenvalue_entry(m, precision), returns_entry(m, precision)

    def lane(
        b: Any,
        eigenvalue: Any = None,
        *,
        noise: float | None = None,
        spread: Spread = at_once,
    ) -> tuple[Any, Any, Any, Any]:
        shape, pixels = b.shape[1:], b[0].size
        planes = np.ascontiguousarray(b).reshape(m + 1, pixels)
        uniform = np.empty(pixels, precision)
        if eigenvalue is not None:
            uniform[:] = eigenvalue.reshape(-1)
        phase, weight = np.empty((m, pixels), precision), np.empty((m, pixels), precision)
        count, residual = np.empty(pixels, np.int32), np.empty(pixels, precision)
        eps = noise or float(np.finfo(precision).eps)
        ill: list[int] = []

        def part(start: int, stop: int) -> None:
            for left, right in blocks(start, stop):
                if eigenvalue is None:
                    run_eigenvalue(order, planes, 0, uniform, left, right)
                worst = run_returns(
                    order, turns, planes, uniform, 0, uniform, phase, weight, count, residual,
                    eps, left, right,
                )  # fmt: skip
                ill.append(worst)

        spread(part, pixels)
        found = (phase, weight, uniform, count)
        if any(ill):
            redo(planes, found, np.flatnonzero(residual > 16 * (m + 1) * eps), eps)
        return (
            phase.reshape((m, *shape)),
            weight.reshape((m, *shape)),
            uniform.reshape(shape),
            count.reshape(shape),
        )

    return lane
