"""Ranges of moments that belong to no frame, by any estimator."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_moments.comparisons import PLUGINS, separated
from transientcam_moments.plugins import CALLERS
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]


def ranges_m(
    b: _Array,
    variance: _Array,
    estimator: str,
    base_frequency_hz: float,
    settings: ReconstructionSettings,
    *,
    zeroth: str = "estimated",
) -> _Array:
    """Return the range (...) that an estimator gives of smoothed moments (m + 1, ...).

    ``b`` is in any unit, ``variance`` (m + 1, ...) of its parts in the square of that; biasing and
    threshold are those of the settings, the estimator is the one given.
    """
    if estimator == "single-frequency":
        phase = np.remainder(np.angle(b[1]), 2 * np.pi)
    elif estimator == "pisarenko":
        phase = tm.separate(tm.pisarenko(b), settings.return_threshold).phase_rad
    elif estimator == "likelihood" or estimator in PLUGINS.names():
        if zeroth == "estimated":  # b_0 is not measured, and has no noise of its own
            variance = np.concatenate([np.zeros_like(variance[:1]), variance[1:]])
        at = settings.return_threshold
        if estimator == "likelihood":
            phase = tm.likelihood(b, tm.noise.MomentNoise(variance)).separate(at).phase_rad
        else:
            told = variance, base_frequency_hz * np.arange(len(b)), at
            phase = CALLERS[-1](PLUGINS.group, separated, estimator, b, *told).phase_rad
    else:
        plain = settings.model_copy(
            update={"neighbours": "none", "minimum_brightness_dn": 0.0, "estimator": estimator}
        )
        phase = tm.reconstruct(b, plain.for_moments(zeroth=zeroth)).phase_rad
    return np.asarray(tm.range_m(phase, base_frequency_hz), dtype=float)
