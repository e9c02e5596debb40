"""The noise of frames: of their moments and of their range, and what it does not explain."""

from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.imaging.calibration import nominal_gains
from transientcam_server.imaging.recipe import Recipe

_Array = NDArray[Any]
SAMPLED_PIXELS: Final = 256
"""Pixels of each frame whose deviation is predicted."""
MEDIAN_OF_NORMAL: Final = 0.674490
"""Median of the absolute value of a standard normal variable."""
EXPLAINED_DEVIATIONS: Final = 4.0
"""Standard deviations of a negative eigenvalue that noise explains."""


@dataclass(frozen=True, slots=True)
class RangeNoise:
    """Predicted standard deviation of a frame's range.

    Attributes
    ----------
    median_m, p90_m
        Half of the pixels, and 90 % of them, are better.
    first_order_share
        Share of the pixels where first order holds, which with the likelihood is where its returns
        explain the moments; that of the others is by the order of magnitude.
    """

    median_m: float
    p90_m: float
    first_order_share: float

    def to_document(self) -> dict[str, float]:
        """Return it as a frame's metadata have it."""
        return {
            "median": self.median_m,
            "p90": self.p90_m,
            "first_order_share": self.first_order_share,
        }


def moment_noise(recipe: Recipe, found: tm.Reconstruction) -> tm.noise.MomentNoise:
    """Return the noise of a frame's smoothed moments (m + 1, H, W), of the recipe's sensor."""
    return tm.noise.smoothed_of(
        partial(_of_pixels, recipe),
        np.asarray(found.smoothed[0].real),
        recipe.settings.smoothing_px,
    )


def range_noise(recipe: Recipe, found: tm.Reconstruction) -> RangeNoise | None:
    """Predict the deviation of a frame's range from its own returns.

    None where no pixel has a range. That of the likelihood is its own, of all pixels; of another
    estimator it is that of Pisarenko's returns in a sample of pixels, which is cheap enough for
    every frame.
    """
    if not np.asarray(found.has_range).any():
        return None
    if recipe.settings.estimator == "likelihood":
        std_m = np.asarray(found.range_std_m)
        first_order = np.asarray(found.likelihood.explained())[np.asarray(found.has_range)]
    else:
        std_m, first_order = _of_pisarenko(recipe, found)
    known = std_m[np.isfinite(std_m)]
    if not known.size:
        return None
    return RangeNoise(
        float(np.median(known)), float(np.quantile(known, 0.9)), float(first_order.mean())
    )


def _of_pisarenko(recipe: Recipe, found: tm.Reconstruction) -> tuple[_Array, _Array]:
    """Return the deviation of the range in m in a sample of pixels, and where first order holds."""
    seen = np.flatnonzero(np.asarray(found.has_range).ravel())
    sample = seen[:: max(1, seen.size // SAMPLED_PIXELS)]

    def sampled(planes: _Array) -> _Array:
        return np.asarray(planes).reshape((planes.shape[0], -1))[:, sample]

    returns = tm.Returns(
        sampled(found.returns.phase_rad),
        sampled(found.returns.weight),
        np.asarray(found.returns.uniform).ravel()[sample],
        np.asarray(found.returns.count).ravel()[sample],
    )
    noise = tm.noise.smoothed_at(
        partial(_of_pixels, recipe),
        np.asarray(found.smoothed[0].real),
        sample,
        recipe.settings.smoothing_px,
    )
    deviation = tm.noise.return_noise(returns, noise, threshold=recipe.settings.return_threshold)
    std_m = tm.range_m(deviation.direct_phase_std_rad, recipe.base_frequency_hz)
    return np.asarray(std_m), np.asarray(deviation.holds)


def _of_pixels(recipe: Recipe, brightness: _Array) -> tm.noise.MomentNoise:
    """Return the noise of moments with this brightness, each pixel by itself."""
    assert recipe.sensor is not None  # noqa: S101 - callers have one, or no noise to predict
    sequence = recipe.applied.sequence
    return tm.noise.moment_noise(
        brightness,
        recipe.sensor,
        calibration=nominal_gains(sequence),
        zeroth=sequence.zeroth,
        takes=sequence.takes,
    )


def contradictions(recipe: Recipe, found: tm.Reconstruction) -> _Array | None:
    """Return where a frame's moments contradict each other by more than its noise explains.

    They do where gain or phase of the frequencies do not go together any more: thermal drift after
    calibration (Sec. 6.4), images out of step, light that moved.

    Returns
    -------
    boolean array, shape (H, W)
        None where that cannot be known: without a sensor, and where b_0 is estimated, as any
        moments then agree.
    """
    if recipe.sensor is None or recipe.applied.sequence.zeroth == "estimated":
        return None
    dark, lit = np.asarray(_of_pixels(recipe, np.array([0.0, 1.0])).variance).sum(axis=0).tolist()

    def of_all(light: _Array) -> tm.noise.MomentNoise:
        """Return the variance of all moments together, which grows linearly with the light."""
        return tm.noise.MomentNoise((dark + (lit - dark) * light)[None])

    brightness = np.asarray(found.smoothed[0].real)
    noise = tm.noise.smoothed_of(of_all, brightness, recipe.settings.smoothing_px)
    return beyond_noise(found, noise)


def beyond_noise(found: tm.Reconstruction, noise: tm.noise.MomentNoise) -> _Array:
    """Return which lit pixels have moments that noise alone does not explain.

    Moments of light have a Toeplitz matrix without negative eigenvalues (Proposition 1); here the
    smallest one is negative by more than `EXPLAINED_DEVIATIONS`.

    Parameters
    ----------
    found
        The frame, (m + 1, H, W).
    noise
        Of its smoothed moments, one by one (m + 1, H, W) or all together (1, H, W).

    Returns
    -------
    boolean array, shape (H, W)
    """
    eigenvalue = np.asarray(found.validity) * np.asarray(found.smoothed[0].real)
    # noise moves no eigenvalue by more than the norm of its own Toeplitz matrix
    std = np.sqrt(np.asarray(noise.variance).sum(axis=0))
    with np.errstate(invalid="ignore"):  # of pixels that are not finite
        return np.asarray((eigenvalue < -EXPLAINED_DEVIATIONS * std) & _lit(found))


def contradictory_share(recipe: Recipe, found: tm.Reconstruction) -> float | None:
    """Return the share of the pixels with light that contradict themselves; None if unknown."""
    contradictory, lit = contradictions(recipe, found), _lit(found)
    if contradictory is None or not lit.any():
        return None
    return float(contradictory[lit].mean())


def _lit(found: tm.Reconstruction) -> _Array:
    unlit = tm.Flags.NO_SIGNAL | tm.Flags.NON_FINITE | tm.Flags.SATURATED
    return np.asarray(np.asarray(found.flags) & unlit == 0)
