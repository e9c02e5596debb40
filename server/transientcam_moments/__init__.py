"""Trigonometric moments of transient light: reconstruction, analysis and their error bounds.

The mathematics of Peters, Klein, Hullin and Klein, *Solving Trigonometric Moment Problems for Fast
Transient Imaging* (SIGGRAPH Asia 2015), as functions of arrays: planes of moments first, any shape
of pixels after them, single or double precision, NumPy, JAX or CuPy. ::

    import transientcam_moments as tm

    b = tm.calibrate(tm.measure(images, zeroth="on-off"), calibration)
    b, biased = tm.bias(tm.smooth(b))
    h = tm.density(tm.levinson(b), phase_rad)
    direct, indirect, phase_rad = tm.separate(tm.pisarenko(b))
"""

from transientcam_moments import comparisons, kernels, noise
from transientcam_moments.errors import (
    DeviceUnavailable,
    MomentsError,
    ParameterError,
    PluginFailed,
    ShapeError,
    UnlabelledImages,
)
from transientcam_moments.images import (
    Average,
    Corrected,
    HarmonicCorrection,
    Repair,
    SweepPhasors,
    average_takes,
    calibrate,
    calibration_of,
    checked_waveform,
    fill_bad_pixels,
    find_bad_pixels,
    four_bucket,
    measure,
    modulation_gain,
    nominal_calibration,
    repair,
    saturated,
    smooth,
    sweep_offsets_rad,
    sweep_phasors,
    waveform_of,
)
from transientcam_moments.likelihood import (
    Likelihood,
    Unwrapped,
    likelihood,
    merge_returns,
    two_returns,
    unwrap,
)
from transientcam_moments.moment_problem import (
    Biased,
    Coefficients,
    Peaks,
    Returns,
    Separation,
    bias,
    bounds,
    cumulative,
    density,
    estimate_zeroth,
    extend,
    from_reflection,
    levinson,
    moments_of,
    peaks,
    pisarenko,
    separate,
    smallest_eigenvalue,
    smoothed_density,
)
from transientcam_moments.noise import Averaged, Still, average_frames, average_neighbours
from transientcam_moments.reconstruction import (
    INVALID,
    SPEED_OF_LIGHT_M_S,
    Flags,
    Labels,
    Measured,
    Reconstruction,
    Reconstructor,
    Settings,
    flags,
    range_m,
    reconstruct,
)

__all__ = [
    "INVALID", "SPEED_OF_LIGHT_M_S", "Average", "Averaged", "Biased", "Coefficients", "Corrected",
    "DeviceUnavailable", "Flags", "HarmonicCorrection", "Labels", "Likelihood", "Measured",
    "MomentsError", "ParameterError", "Peaks", "PluginFailed", "Reconstruction", "Reconstructor",
    "Repair", "Returns", "Separation", "Settings", "ShapeError", "Still", "SweepPhasors",
    "UnlabelledImages", "Unwrapped", "average_frames", "average_neighbours", "average_takes",
    "bias", "bounds", "calibrate", "calibration_of", "checked_waveform", "comparisons",
    "cumulative", "density", "estimate_zeroth", "extend", "fill_bad_pixels", "find_bad_pixels",
    "flags", "four_bucket", "from_reflection", "kernels", "levinson", "likelihood", "measure",
    "merge_returns", "modulation_gain", "moments_of", "noise", "nominal_calibration", "peaks",
    "pisarenko", "range_m", "reconstruct", "repair", "saturated", "separate", "smallest_eigenvalue",
    "smooth", "smoothed_density", "sweep_offsets_rad", "sweep_phasors", "two_returns", "unwrap",
    "waveform_of",
]  # fmt: skip
