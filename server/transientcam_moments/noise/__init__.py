"""How noise of the sensor becomes uncertainty of moments, returns, range and density.

From a sensor to the covariance of calibrated moments (`moment_noise`), from there to first order
to the returns (`return_noise`) and the density (`density_std`), with the bound
that no unbiased estimate of the returns falls below (`cramer_rao`). `return_noise` marks
where first order holds. Where it does not, `draw` gives noisy moments to put
through the estimator itself. ::

    noise = tm.noise.moment_noise(b[0].real, sensor, calibration=gain, zeroth="on-off")
    noise = tm.noise.smoothed(noise, sigma_px=0.6)
    deviation = tm.noise.return_noise(tm.pisarenko(b), noise)
    range_std_m = tm.range_m(deviation.direct_phase_std_rad, 23e6)
"""

from transientcam_moments.noise import (
    _first_order as first_order,
    _interpolation as interpolation,
    _neighbours as neighbours,
)
from transientcam_moments.noise._ambient import ambient_light
from transientcam_moments.noise._cramer_rao import CramerRao, cramer_rao
from transientcam_moments.noise._density import density_std
from transientcam_moments.noise._moments import (
    ASSUMED_NOISE,
    MomentNoise,
    draw,
    free_of_scale,
    moment_noise,
    own_share,
    scatter,
    smoothed,
    smoothed_at,
    smoothed_of,
    smoothing_factor,
)
from transientcam_moments.noise._neighbours import Averaged, average_neighbours
from transientcam_moments.noise._of_images import CapturedImages, image_noise
from transientcam_moments.noise._returns import ReturnNoise, direct_phase_noise, return_noise
from transientcam_moments.noise._sensor import ROUNDING_VARIANCE, ImageNoise, Sensor
from transientcam_moments.noise._still import MOST_FRAMES, Still, average_frames

__all__ = [
    "ASSUMED_NOISE", "MOST_FRAMES", "ROUNDING_VARIANCE", "Averaged", "CapturedImages", "CramerRao",
    "ImageNoise", "MomentNoise", "ReturnNoise", "Sensor", "Still", "ambient_light",
    "average_frames", "average_neighbours", "cramer_rao", "density_std", "direct_phase_noise",
    "draw", "first_order", "free_of_scale", "image_noise", "interpolation", "moment_noise",
    "neighbours", "own_share", "return_noise", "scatter", "smoothed", "smoothed_at", "smoothed_of",
    "smoothing_factor",
]  # fmt: skip
