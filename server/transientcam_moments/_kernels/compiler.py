"""Every lane by its name. Importing this module imports numba: only the compiling thread does."""

import os
import threading
from collections.abc import Callable
from typing import Any

from numba.core import event

from transientcam_moments._kernels.cache import cache_directory, digest_of_sources
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
from transientcam_moments._lanes.registry import Key, Lane

LANES: dict[str, Callable[[int, str], Lane]] = {
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


class _NotKept(Exception):  # noqa: N818 - says what the cache lacks
    """A kernel would have to be compiled."""


class _Refusal(event.Listener):
    """Keeps the thread that makes it from compiling; numba asks it where the cache has nothing."""

    def __init__(self) -> None:
        self._thread = threading.get_ident()

    def on_start(self, event: Any) -> None:
        if threading.get_ident() == self._thread:
            raise _NotKept

    def on_end(self, event: Any) -> None:
        pass


def compile_lane(key: Key) -> Lane:
    """Compile one lane, or load it from the cache."""
    return LANES[key.name](key.harmonics, key.precision)


def load_lane(key: Key) -> Lane | None:
    """Load one lane from the cache; None where it is not there whole."""
    try:
        with event.install_listener("numba:compile", _Refusal()):
            return compile_lane(key)
    except _NotKept:
        return None


def is_kept() -> bool:
    """Say whether there is a cache, for what this process or another one compiles."""
    return cache_directory(os.environ, digest_of_sources()) is not None
