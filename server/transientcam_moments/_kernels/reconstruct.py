"""The entries that a `Reconstructor` runs on, compiled for one order."""

from collections.abc import Callable
from typing import Any

from transientcam_moments._kernels import back
from transientcam_moments._kernels.eigenvalue import eigenvalue_entry
from transientcam_moments._kernels.entries import (
    BYTES,
    COUNTS,
    PIXELS,
    PLACES,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.frames import measure_entry, separate_entry, smooth_entry
from transientcam_moments._kernels.levinson import levinson_entry
from transientcam_moments._kernels.pisarenko import half_turns, returns_entry
from transientcam_moments._kernels.reconstructor import Entries, Reconstructor


def reconstruct_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile all stages of order m; the lane makes a `Reconstructor`."""
    entries = reconstruct_entries(m, precision)
    return lambda *arguments: Reconstructor(entries, *arguments)


def reconstruct_entries(m: int, precision: str) -> Entries:
    """Compile all stages of order m."""
    order = order_type(m)
    real, cplx = real_arrays(precision), complex_arrays(precision)
    wide = real_arrays("d")
    plane, planes = real[1], real[2]
    return Entries(
        order=(0,) * m,
        precision=precision,
        turns=half_turns(m, precision),
        wide_turns=half_turns(m, "d"),
        measure=measure_entry(m),
        smooth=smooth_entry(),
        eigenvalue=eigenvalue_entry(m, precision),
        judge=entry(
            back.judge,
            order, PIXELS, cplx[2], BYTES, plane, plane, plane, plane, BYTES, REAL, REAL,
            PIXELS, PIXELS,
        ),
        levinson=levinson_entry(m, precision),
        returns=returns_entry(m, precision),
        separate=separate_entry(m),
        gather=entry(
            back.gather,
            order, cplx[2], plane, plane, REAL, complex_arrays("d")[2], PLACES, PIXELS,
        ),
        scatter=entry(
            back.scatter,
            order, PLACES, PIXELS, wide[2], wide[2], COUNTS, wide[1],
            planes, planes, COUNTS, plane,
        ),
        wide_eigenvalue=eigenvalue_entry(m, "d"),
        wide_returns=returns_entry(m, "d"),
    )  # fmt: skip
