"""The compiled stages of `OnePass`, for one order."""

from collections.abc import Callable
from typing import Any

from transientcam_moments._kernels import outputs
from transientcam_moments._kernels.circle import half_turns
from transientcam_moments._kernels.compiled_entry import (
    BYTES,
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.eigenvalue import eigenvalue_entry
from transientcam_moments._kernels.frames import measure_entry, separate_entry, smooth_entry
from transientcam_moments._kernels.one_pass import Constants, OnePass, Stages
from transientcam_moments._kernels.returns import returns_entry, usual_steps
from transientcam_moments._kernels.wide import WideReturns


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
    plane = real[1]
    return Stages(
        order=(0,) * m,
        turns=half_turns(m, "f"),
        measure=measure_entry(m),
        smooth=smooth_entry(),
        eigenvalue=eigenvalue_entry(m, "f"),
        flag_and_bias=entry(
            outputs.flag_and_bias,
            order, PIXELS, cplx[2], BYTES, plane, plane, plane, plane, BYTES, REAL, REAL,
            PIXELS, PIXELS,
        ),
        returns=returns_entry(m, "f"),
        steps=usual_steps(m, "f"),
        separate=separate_entry(m),
        wide=WideReturns(m),
    )  # fmt: skip
