"""Estimators of other packages: entries of ``transientcam.estimators``, each a `Technique`."""

from functools import partial
from typing import Final

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import Estimate
from transientcam_moments.comparisons._technique import Technique
from transientcam_moments.errors import PluginFailed
from transientcam_moments.moment_problem import Separation
from transientcam_moments.noise import MomentNoise
from transientcam_moments.plugins import Plugins, in_words

PLUGINS: Final = Plugins("estimator", Technique)


def separated(
    name: str, b: Array, variance: Array | None, frequencies_hz: Array, threshold: float
) -> Separation:
    """Return direct and indirect light and phase (...) by the technique of another package.

    A pixel whose phase or light is not finite has none.

    Parameters
    ----------
    name
        Of the entry.
    b, variance : array, shape (m + 1, ...)
        Moments, and the variance of their real and imaginary parts; None where it isn't known.
    frequencies_hz : array, shape (m + 1,)
        Of the moments; NaN where no base frequency is known.
    threshold
        As that of `separate`.

    Raises
    ------
    PluginFailed
        Where it raises, returns something else, or has no phase in any pixel that has light.
    """
    noise = None if variance is None else MomentNoise(variance)
    technique, failed = PLUGINS.load(name), partial(PluginFailed, PLUGINS.kind, name)
    try:
        with np.errstate(all="ignore"):  # of pixels without light
            estimate: object = technique.of(b.copy(), noise, frequencies_hz)
            if not isinstance(estimate, Estimate):
                raise failed(f"it returned {estimate!r:.60}, no Estimate")
            parts = [np.asarray(part) for part in estimate.separate(threshold)]
        direct, indirect, phase = (part.astype(b.real.dtype, casting="same_kind") for part in parts)
    except PluginFailed:
        raise
    except Exception as error:
        raise failed(in_words(error)) from error
    for field, part in zip(Separation._fields, (direct, indirect, phase), strict=True):
        if part.shape != b.shape[1:]:
            raise failed(f"its {field} has shape {part.shape}, and the pixels have {b.shape[1:]}")
    there = np.isfinite(direct) & np.isfinite(indirect) & np.isfinite(phase)
    if (b[0].real > 0).any() and not there.any():
        raise failed("it has no finite phase and light in any pixel")
    direct, indirect = np.where(there, direct, 0), np.where(there, indirect, 0)
    return Separation(direct, indirect, np.remainder(np.where(there, phase, np.nan), 2 * np.pi))
