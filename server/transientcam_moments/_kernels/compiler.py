"""Every kernel by its name. Importing this module imports numba: only the compiling thread does."""

from collections.abc import Callable

from transientcam_moments._dispatch import Kernel, Key
from transientcam_moments._kernels.covariance import covariance_kernel
from transientcam_moments._kernels.density import density_kernel
from transientcam_moments._kernels.direct_noise import direct_noise_kernel
from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue_kernel
from transientcam_moments._kernels.frames import measure_kernel, separate_kernel, smooth_kernel
from transientcam_moments._kernels.harmonics import harmonics_kernel
from transientcam_moments._kernels.levinson import levinson_kernel
from transientcam_moments._kernels.likelihood import likelihood_kernel
from transientcam_moments._kernels.neighbours import neighbours_kernel
from transientcam_moments._kernels.pairs import pairs_kernel
from transientcam_moments._kernels.peaks import peaks_kernel
from transientcam_moments._kernels.pisarenko import pisarenko_kernel
from transientcam_moments._kernels.reconstruct import reconstruct_kernel

COMPILERS: dict[str, Callable[[int, str], Kernel]] = {
    "pisarenko": pisarenko_kernel,
    "smallest_eigenvalue": smallest_eigenvalue_kernel,
    "levinson": levinson_kernel,
    "density": density_kernel,
    "peaks": peaks_kernel,
    "measure": measure_kernel,
    "smooth": smooth_kernel,
    "neighbours": neighbours_kernel,
    "separate": separate_kernel,
    "reconstruct": reconstruct_kernel,
    "likelihood": likelihood_kernel,
    "pairs": pairs_kernel,
    "harmonics": harmonics_kernel,
    "covariance": covariance_kernel,
    "direct_noise": direct_noise_kernel,
}


def compile_kernel(key: Key) -> Kernel:
    """Compile one kernel, or load it from the cache."""
    return COMPILERS[key.name](key.harmonics, key.precision)
