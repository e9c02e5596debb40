"""The compiled stages of `OnePass`, for one order."""

from collections.abc import Callable
from typing import Any

from transientcam_moments._kernels import inputs, outputs
from transientcam_moments._kernels.analysis import analysis_entry
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.frames import measure_and_smooth_entry
from transientcam_moments._kernels.one_pass import Constants, OnePass, Stages
from transientcam_moments._kernels.returns import usual_steps
from transientcam_moments._kernels.wide import WideReturns
from transientcam_moments.moment_problem import half_turns


def reconstruct_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile all stages of order m; the kernel prepares the pass for pixels of one shape."""
    stages = reconstruct_stages(m)

    def kernel(shape: tuple[int, ...], constants: Constants) -> OnePass:
        return OnePass(stages, shape, constants)

    return kernel


def reconstruct_stages(m: int) -> Stages:
    """Compile all stages of order m in single precision."""
    return Stages(
        order=(0,) * m,
        turns=half_turns(m, "f"),
        measure=entry(inputs.measure, m, "f"),
        smooth=entry(inputs.smooth, m, "f"),
        measure_and_smooth=measure_and_smooth_entry(m),
        analyse=analysis_entry(m),
        steps=usual_steps(m, "f"),
        separate=entry(outputs.separate, m, "f"),
        wide=WideReturns(m),
    )
