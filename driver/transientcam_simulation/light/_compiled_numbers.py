"""Functions of numbers that NumPy and compiled code share, from `coverage`: compiled here."""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numba import extending

from transientcam_simulation.compiled import inner
from transientcam_simulation.light import _coverage as coverage
from transientcam_simulation.light._coverage import Ball, Plane, Plate, ball_of

__all__ = ["at_border", "ball_of", "near_ellipsoid", "on_rectangle", "rows_of"]
_HOW = {"nogil": True, "error_model": "numpy", "forceinline": True}
_extending: Any = extending  # numba is only partly annotated
One = np.float32
Three = tuple[One, One, One]
Four = tuple[One, One, One, One]
at_border = cast("Callable[[One, One, One, One, One], Four]", coverage.at_border)
near_ellipsoid = cast("Callable[[Ball, One, One, One], Three]", coverage.near_ellipsoid)
on_rectangle = cast("Callable[[Plate, One, One, One], Four]", coverage.on_rectangle)


_PORTABLE: tuple[Callable[..., Any], ...] = (
    coverage.slope,
    coverage.half_plane,
    at_border,
    ball_of,
    near_ellipsoid,
    on_rectangle,
)
for _each in _PORTABLE:
    _extending.register_jitable(**_HOW)(_each)


def _choose(condition: bool, one: np.float32, other: np.float32) -> np.float32:
    return one if condition else other


_extending.overload(coverage.select, jit_options=_HOW, strict=False)(lambda *_types: _choose)


@inner
def rows_of(plate: Plane) -> Plate:
    """Return what `on_rectangle` takes: rows of numbers, which need no array."""
    one, two, three = plate[0], plate[1], plate[2]
    return (
        (one[0], one[1], one[2], one[3], one[4]),
        (two[0], two[1], two[2], two[3], two[4]),
        (three[0], three[1], three[2], three[3], three[4]),
    )
