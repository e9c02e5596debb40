"""The noise of frames: of their moments and of their range, and what it does not explain."""

from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam.documents import PredictedStdDocument
from transientcam_moments.noise import direct_phase_noise
from transientcam_moments.reconstruction import OF_ANY_MULTIPLES
from transientcam_server.imaging._recipe.recipe import Recipe

_Array = NDArray[Any]
SAMPLED_PIXELS: Final = 256
"""Pixels of each frame whose deviation is predicted by Pisarenko's returns."""
FITTED_PIXELS: Final = 1 << 14
"""And whose deviation is taken from an estimate that has it of all of them."""
EXPLAINED_DEVIATIONS: Final = 4.0
"""Standard deviations of a negative eigenvalue that noise explains."""
_UNLIT: Final = np.uint8(tm.Flags.NO_SIGNAL | tm.Flags.NON_FINITE | tm.Flags.SATURATED)
_BLOCK_PIXELS: Final = 1 << 16


def moment_noise(recipe: Recipe, found: tm.Reconstruction) -> tm.noise.MomentNoise:
    """Return the noise of a frame's smoothed moments (m + 1, H, W), of the recipe's sensor."""
    noise = tm.noise.smoothed_of(
        partial(_of_pixels, recipe),
        np.asarray(found.smoothed[0].real),
        found.settings.gaussian_px,
        ambient=found.ambient,
    )
    return tm.noise.MomentNoise(noise.variance * _share(found))


def range_noise(recipe: Recipe, found: tm.Reconstruction) -> PredictedStdDocument | None:
    """Predict the standard deviation of a frame's range between frames, by noise alone.

    None where no pixel has a range. That of `OF_ANY_MULTIPLES` is the estimate's own, and first
    order holds where its returns explain the moments; of another estimator it is that of
    Pisarenko's returns in a sample of pixels, which is cheap enough for every frame.
    """
    has_range = np.asarray(found.has_range)  # compared anew whenever it is read
    if not has_range.any():
        return None
    if recipe.technique in OF_ANY_MULTIPLES:
        std_m = np.asarray(found.range_scatter_m(_sample(has_range.ravel(), FITTED_PIXELS)))
        first_order = np.asarray(found.estimate.explained())[has_range]
    else:
        std_m, first_order = _of_pisarenko(recipe, found, has_range)
    known = std_m[np.isfinite(std_m)]
    if not known.size:
        return None
    median_m, p90_m = np.quantile(known, (0.5, 0.9)).tolist()
    return {"median": median_m, "p90": p90_m, "first_order_share": float(first_order.mean())}


def _of_pisarenko(
    recipe: Recipe, found: tm.Reconstruction, has_range: _Array
) -> tuple[_Array, _Array]:
    """Return the deviation of the range in m in a sample of pixels, and where first order holds."""
    sample = _sample(has_range.ravel())

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
        found.settings.gaussian_px,
        ambient=found.ambient,
    )
    noise = tm.noise.MomentNoise(noise.variance * _share(found).ravel()[sample])
    std_rad, holds = direct_phase_noise(returns, noise, threshold=recipe.settings.return_threshold)
    return np.asarray(tm.range_m(std_rad, recipe.base_frequency_hz)), np.asarray(holds)


def _sample(seen: _Array, pixels: int = SAMPLED_PIXELS) -> _Array:
    """Return the places of at least so many of the pixels that are seen, if there are, evenly."""
    count = int(np.count_nonzero(seen))
    step = max(1, count // pixels)
    return np.arange(0, count, step) if count == seen.size else np.flatnonzero(seen)[::step]


def _of_pixels(
    recipe: Recipe, brightness: _Array, ambient: _Array | float = 0.0
) -> tm.noise.MomentNoise:
    """Return the noise of moments with this brightness and other light, each pixel by itself."""
    light = np.maximum(brightness, 0)
    variance = recipe.moment_variance.astype(light.dtype)
    dark, slope, other = variance.reshape((3, -1, *(1,) * light.ndim))
    return tm.noise.MomentNoise(dark + slope * light + other * ambient)


def contradictions(recipe: Recipe, found: tm.Reconstruction) -> _Array | None:
    """Return where (H, W) a frame's moments contradict each other by more than its noise explains.

    They do where gain or phase of the frequencies do not go together any more: thermal drift after
    calibration (Sec. 6.4), images out of step, light that moved. None where that cannot be known:
    without a sensor, where b_0 is estimated, as any moments then agree, and for gaps.
    """
    sequence = recipe.applied.sequence
    if recipe.sensor is None or sequence.zeroth == "estimated":
        return None
    if not sequence.sampling.consecutive:
        return None
    dark, slope, other = recipe.moment_variance.sum(axis=1).tolist()

    def of_all(light: _Array, ambient: _Array | float = 0.0) -> tm.noise.MomentNoise:
        """Return the variance of all moments together, which grows linearly with the light."""
        return tm.noise.MomentNoise((dark + slope * light + other * ambient)[None])

    return beyond_noise(found, of_all)


def beyond_noise(found: tm.Reconstruction, noise_of: Callable[..., tm.noise.MomentNoise]) -> _Array:
    """Return which lit pixels (H, W) have moments that noise alone does not explain.

    Moments of light have a Toeplitz matrix without negative eigenvalues (Proposition 1); here the
    smallest one is negative by more than `EXPLAINED_DEVIATIONS`. ``noise_of`` returns the noise of
    moments with a brightness above 0 before smoothing, to which its variance is affine: of each
    moment (m + 1, ...), or of all together (1, ...); with ``ambient=`` where there is other light.
    """
    beyond = _beyond_own_share(found, noise_of)
    doubtful = np.flatnonzero(beyond)
    if not doubtful.size:
        return beyond
    brightness = np.asarray(found.smoothed[0].real)
    eigenvalue = np.asarray(found.validity).flat[doubtful] * brightness.flat[doubtful]
    ambient = found.ambient
    noise = tm.noise.smoothed_at(
        noise_of, brightness, doubtful, found.settings.gaussian_px, ambient=ambient
    ).variance
    std = np.sqrt(noise.sum(axis=0) * _share(found).ravel()[doubtful])
    beyond.flat[doubtful] = eigenvalue < -EXPLAINED_DEVIATIONS * std
    return beyond


def _beyond_own_share(
    found: tm.Reconstruction, noise_of: Callable[..., tm.noise.MomentNoise]
) -> _Array:
    """Return where the part of the noise that is a pixel's own does not explain its moments.

    That of other light than the camera's is left for later: most frames have none. Noise moves no
    eigenvalue by more than the norm of its own Toeplitz matrix, and a pixel's own share of it
    settles most pixels without a look at their neighbours.
    """
    limit = EXPLAINED_DEVIATIONS**2 * tm.noise.own_share(found.settings.gaussian_px)
    share = _share(found).reshape(-1)
    beyond = _lit(found)
    places = beyond.reshape(-1)
    light = np.asarray(found.smoothed[0].real).reshape(-1)
    validity = np.asarray(found.validity).reshape(-1)
    # affine in the light: with what two brightnesses have, no block needs its planes of moments
    dark, lit = noise_of(np.array([0, 1], light.dtype)).variance.sum(axis=0).tolist()
    slope, dark = limit * (lit - dark), limit * dark
    room = np.empty((2, min(places.size, _BLOCK_PIXELS)), light.dtype)
    for start in range(0, places.size, _BLOCK_PIXELS):  # which stay in the caches
        block = slice(start, start + _BLOCK_PIXELS)
        square, most = room[:, : places[block].size]
        most[:] = light[block]  # real parts lie apart: once is enough; lit, so above 0
        np.multiply(validity[block], most, out=square)
        np.multiply(square, square, out=square)
        most *= slope
        most += dark
        most *= share[block]
        places[block] &= square > most
        places[block] &= validity[block] < 0
    return beyond


def contradictory_share(recipe: Recipe, found: tm.Reconstruction) -> float | None:
    """Return the share of the pixels with light that contradict themselves; None if unknown."""
    contradictory, lit = contradictions(recipe, found), _lit(found)
    if contradictory is None or not lit.any():
        return None
    return float(contradictory[lit].mean())


def _share(found: tm.Reconstruction) -> _Array:
    """Return what edge-preserving averaging has left of pixels' variance; 1 of the Gaussian's."""
    share = found.variance_share
    return np.ones(found.smoothed.shape[1:], np.float32) if share is None else np.asarray(share)


def _lit(found: tm.Reconstruction) -> _Array:
    return np.asarray(np.asarray(found.flags) & _UNLIT == 0)
