"""Every kernel by its name. Importing this module imports numba: only the compiling thread does."""

from collections.abc import Callable

from transientcam_moments._dispatch import Kernel, Key
from transientcam_moments._kernels.covariance import covariance_lane
from transientcam_moments._kernels.density import density_lane
from transientcam_moments._kernels.direct_noise import direct_noise_lane
from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue_lane
from transientcam_moments._kernels.frames import measure_lane, separate_lane, smooth_lane
from transientcam_moments._kernels.harmonics import harmonics_lane
from transientcam_moments._kernels.levinson import levinson_lane
from transientcam_moments._kernels.likelihood import likelihood_lane
from transientcam_moments._kernels.pairs import pairs_lane
from transientcam_moments._kernels.peaks import peaks_lane
from transientcam_moments._kernels.pisarenko import pisarenko_lane
from transientcam_moments._kernels.reconstruct import reconstruct_lane

COMPILERS: dict[str, Callable[[int, str], Kernel]] = {
    "pisarenko": pisarenko_lane,
    "smallest_eigenvalue": smallest_eigenvalue_lane,
    "levinson": levinson_lane,
    "density": density_lane,
    "peaks": peaks_lane,
    "measure": measure_lane,
    "smooth": smooth_lane,
    "separate": separate_lane,
    "reconstruct": reconstruct_lane,
    "likelihood": likelihood_lane,
    "pairs": pairs_lane,
    "harmonics": harmonics_lane,
    "covariance": covariance_lane,
    "direct_noise": direct_noise_lane,
}


def compile_kernel(key: Key) -> Kernel:
    """Compile one kernel, or load it from the cache."""
    return COMPILERS[key.name](key.harmonics, key.precision)
