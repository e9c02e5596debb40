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
from transientcam_moments.bad_pixels import fill_bad_pixels, find_bad_pixels
from transientcam_moments.biasing import (
    Biased,
    bias,
    estimate_zeroth,
    smallest_eigenvalue,
)
from transientcam_moments.bounds import bounds, smoothed_density
from transientcam_moments.calibration import calibrate, calibration_of, nominal_calibration
from transientcam_moments.cumulative import cumulative
from transientcam_moments.errors import (
    MomentsError,
    ParameterError,
    ShapeError,
    UnlabelledImages,
)
from transientcam_moments.flags import INVALID, Flags, flags
from transientcam_moments.four_bucket import four_bucket, measure, saturated
from transientcam_moments.harmonics import Corrected, HarmonicCorrection, checked_waveform
from transientcam_moments.labels import Labels
from transientcam_moments.levinson import (
    Coefficients,
    extend,
    from_reflection,
    levinson,
    moments_of,
)
from transientcam_moments.likelihood import Likelihood, likelihood
from transientcam_moments.likelihood.pairs import two_returns
from transientcam_moments.maximum_entropy import density
from transientcam_moments.merging import merge_returns
from transientcam_moments.modulation import modulation_gain
from transientcam_moments.peaks import Peaks, peaks
from transientcam_moments.pisarenko import Returns, Separation, pisarenko, separate
from transientcam_moments.ranging import SPEED_OF_LIGHT_M_S, range_m
from transientcam_moments.reconstruction import Reconstruction
from transientcam_moments.reconstructor import Reconstructor, reconstruct
from transientcam_moments.repair import Repair, repair
from transientcam_moments.settings import Settings
from transientcam_moments.smoothing import smooth
from transientcam_moments.sweep import (
    SweepPhasors,
    sweep_offsets_rad,
    sweep_phasors,
    waveform_of,
)
from transientcam_moments.takes import Average, average_takes
from transientcam_moments.unwrapping import Unwrapped, unwrap

__all__ = [
    "INVALID",
    "SPEED_OF_LIGHT_M_S",
    "Average",
    "Biased",
    "Coefficients",
    "Corrected",
    "Flags",
    "HarmonicCorrection",
    "Labels",
    "Likelihood",
    "MomentsError",
    "ParameterError",
    "Peaks",
    "Reconstruction",
    "Reconstructor",
    "Repair",
    "Returns",
    "Separation",
    "Settings",
    "ShapeError",
    "SweepPhasors",
    "UnlabelledImages",
    "Unwrapped",
    "average_takes",
    "bias",
    "bounds",
    "calibrate",
    "calibration_of",
    "checked_waveform",
    "comparisons",
    "cumulative",
    "density",
    "estimate_zeroth",
    "extend",
    "fill_bad_pixels",
    "find_bad_pixels",
    "flags",
    "four_bucket",
    "from_reflection",
    "kernels",
    "levinson",
    "likelihood",
    "measure",
    "merge_returns",
    "modulation_gain",
    "moments_of",
    "noise",
    "nominal_calibration",
    "peaks",
    "pisarenko",
    "range_m",
    "reconstruct",
    "repair",
    "saturated",
    "separate",
    "smallest_eigenvalue",
    "smooth",
    "smoothed_density",
    "sweep_offsets_rad",
    "sweep_phasors",
    "two_returns",
    "unwrap",
    "waveform_of",
]
