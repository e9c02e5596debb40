"""The compiled stages of `OnePass`, for one order."""

from collections.abc import Callable
from typing import Any

from transientcam_moments._kernels import outputs
from transientcam_moments._kernels.compiled_entry import (
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
from transientcam_moments._kernels.eigenvalue import eigenvalue_entry
from transientcam_moments._kernels.frames import measure_entry, separate_entry, smooth_entry
from transientcam_moments._kernels.one_pass import Constants, OnePass, Stages
from transientcam_moments._kernels.pisarenko import half_turns, returns_entry


def reconstruct_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile all stages of order m; the lane prepares the pass for pixels of one shape."""
    stages = reconstruct_stages(m)

    def lane(shape: tuple[int, ...], constants: Constants) -> OnePass:
        return OnePass(stages, shape, constants)

    return lane


def reconstruct_stages(m: int) -> Stages:
    """Compile all stages of order m in single precision."""
    order = order_type(m)
    real, cplx = real_arrays("f"), complex_arrays("f")
    wide, wide_cplx = real_arrays("d"), complex_arrays("d")
    plane, planes = real[1], real[2]
    return Stages(
        order=(0,) * m,
        turns=half_turns(m, "f"),
        wide_turns=half_turns(m, "d"),
        measure=measure_entry(m),
        smooth=smooth_entry(),
        eigenvalue=eigenvalue_entry(m, "f"),
        flag_and_bias=entry(
            outputs.flag_and_bias,
            order, PIXELS, cplx[2], BYTES, plane, plane, plane, plane, BYTES, REAL, REAL,
            PIXELS, PIXELS,
        ),
        returns=returns_entry(m, "f"),
        separate=separate_entry(m),
        gather=entry(
            outputs.gather,
            order, cplx[2], plane, plane, REAL, wide_cplx[2], PLACES, PIXELS,
        ),
        scatter=entry(
            outputs.scatter,
            order, PLACES, PIXELS, wide[2], wide[2], COUNTS, wide[1],
            planes, planes, COUNTS, plane,
        ),
        wide_eigenvalue=eigenvalue_entry(m, "d"),
        wide_returns=returns_entry(m, "d"),
    )  # fmt: skip
