"""The likelihood of few returns: the fits of `transientcam_moments.likelihood` in kernels.

Pixels go through in blocks. Each model is fitted to the pixels that simpler ones leave something to
explain, packed without gaps between stages, so that vectors are full; so are the pixels whose tail
has not settled after a few steps. What a pixel gets does not depend on how it is packed.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._dispatch import MOST_ROOTS
from transientcam_moments._kernels.arrays import (
    Complexes,
    ComplexPlanes,
    Counts,
    RealPlanes,
    Reals,
)
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.packing import PIXELS_AT_ONCE, ROW
from transientcam_moments._kernels.portable import length_up_to
from transientcam_moments._kernels.stages import (
    TAIL_ROUNDS,
    bring_back,
    finish,
    fit_first,
    fit_second,
    fit_third,
    offer_tails,
    rows_of,
    step_late,
    take_three,
)
from transientcam_moments.arrays import Length
from transientcam_moments.likelihood import MOST_RETURNS, TAIL_SHAPE, choice


@njit(nogil=True, error_model="numpy")
def fit_returns(
    m: int, slots: Length, turns: RealPlanes, b: ComplexPlanes, variance: RealPlanes, error:
    float, planes: RealPlanes, free: Counts, count: Counts, start: int, stop: int,
) -> None:  # fmt: skip
    """Write the estimate of the pixels start..stop; each model where simpler ones leave enough.

    The order m is known only now: loops over it cost a twentieth of the time, while compiling for
    each order would take a quarter of a minute each.
    """
    order = length_up_to(m, MOST_ROOTS)
    size = rows_of(order) * ROW
    all_rooms, rooms = np.empty(size, planes.dtype), np.empty(size, planes.dtype)
    late, later = np.empty(size, planes.dtype), np.empty(size, planes.dtype)
    third = np.empty(size, planes.dtype)
    for first in range(start, stop, PIXELS_AT_ONCE):
        last = min(first + PIXELS_AT_ONCE, stop)
        more = fit_first(order, turns, b, variance, error, first, last, stop, all_rooms, rooms)
        if len(order) >= 2 and more > 0:
            moving = fit_second(order, turns, rooms, more, late)
            if moving > 0:
                still = step_late(order, TAIL_ROUNDS[1], late, moving, later)
                if still > 0:
                    step_late(order, TAIL_ROUNDS[2], later, still, third)
                    bring_back(late, moving, later)
                bring_back(rooms, more, late)
            three = offer_tails(order, rooms, more, third)
            if len(order) >= 3 and three > 0:
                fit_third(order, turns, third, three)
                take_three(rooms, more, third)
        finish(order, slots, all_rooms, rooms, first, last, stop, planes, free, count)


def likelihood_kernel(most: int, precision: str) -> Callable[..., Any]:
    """Compile the estimate of orders up to ``most``; see the table in ``_dispatch``."""
    slots = (0,) * MOST_RETURNS
    run = entry(fit_returns, most, precision, slots=len(slots))
    turns_of = lru_cache(lambda m: choice.turns_of(m).astype(precision))

    def kernel(
        b: Complexes,
        variance: Reals,
        returns: int,
        tail_shape: int,
        error: float,
        *,
        spread: Spread = at_once,
    ) -> tuple[Any, ...] | None:
        if (returns, tail_shape) != (MOST_RETURNS, TAIL_SHAPE):
            return None
        m, pixels, size = len(b) - 1, b.shape[1], len(slots)
        turns = turns_of(m)
        moments, noise = np.ascontiguousarray(b), np.ascontiguousarray(variance)
        planes = empty((4 * size + 5, pixels), precision)
        free, count = empty(pixels, np.int32), empty(pixels, np.int32)

        def part(start: int, stop: int) -> None:
            run(m, slots, turns, moments, noise, error, planes, free, count, start, stop)

        spread(part, pixels)
        four = (planes[k * size :][: min(m, size)] for k in range(4))
        return (*four, *planes[4 * size :], free, count)

    return kernel
