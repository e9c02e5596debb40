"""From the moments of a look to the statistics of a scene."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.imaging import Recipe, nominal_gains
from transientcam_server.planning._scene.estimation import direct_range
from transientcam_server.planning._scene.plausible import plausible_ranges
from transientcam_server.planning._scene.sampling import STRATUM, one_of_each, typical_pixels
from transientcam_server.planning._scene.scene import PIXELS, SceneStatistics
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
LIT_DEVIATIONS: Final = 5.0
"""Standard deviations that the light of a lit pixel stands clear of noise by."""
LIT_FRAMES: Final = 8
"""Frames whose noise it is, at most."""
MOVED_DEVIATIONS: Final = 5.0
_EARLY: Final = 0.9
"""Share of a period by which a direct return may come before the mean of all light."""
DIM: Final = 0.2
"""What a surface gets from a lit one beside it, over what that one gets, is hardly more."""
BRIGHT_SHARE: Final = 0.95
"""All but the brightest pixels, which may be a mirror's."""
BRIGHTEST_SHARE: Final = 0.999
"""Share of the pixels that nothing planned may saturate."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameAverages:
    """What frames of one sequence show.

    Attributes
    ----------
    recipe, sensor
        How they were captured.
    frames
        How many.
    moments
        (m + 1, H, W) smoothed moments, averaged over the frames.
    moved
        (m + 1, H, W) smoothed moments of the last frame less those of the first.
    single
        (m + 1, H, W) moments that are not smoothed, averaged over the frames.
    mean_dn
        (H, W) mean of all four-bucket images above the dark level.
    highest_dn
        (H, W) the most that an image holds above the dark level.
    usable
        (H, W) which pixels are not saturated.
    """

    recipe: Recipe
    sensor: tm.noise.Sensor
    frames: int
    moments: _Array
    moved: _Array
    single: _Array
    mean_dn: _Array
    highest_dn: _Array
    usable: _Array

    def brightest_dn(self, within: _Array | None = None) -> float:
        """Return what the brightest pixels, of those within (H, W), hold above the dark level."""
        chosen = self.highest_dn if within is None else self.highest_dn[within]
        return float(np.quantile(chosen, BRIGHTEST_SHARE))

    @property
    def exposure_s(self) -> float:
        """Of one image."""
        return self.recipe.applied.sequence.exposure_s

    def at(self, pixels: _Array) -> tuple[_Array, _Array]:
        """Return the moments (m + 1, P), averaged over frames, and the mean of the images (P)."""
        b = self.moments
        return b.reshape((len(b), -1))[:, pixels], self.mean_dn.ravel()[pixels]

    def variance(self, signal_dn: _Array) -> _Array:
        """Return the variance (m + 1, ...) of a frame's smoothed moments.

        Parameters
        ----------
        signal_dn
            (...) mean of the images above the dark level, ambient light included.
        """
        sequence = self.recipe.applied.sequence
        noise = tm.noise.moment_noise(
            2 * np.maximum(signal_dn, 0.0),
            self.sensor,
            calibration=nominal_gains(sequence),
            zeroth=sequence.zeroth,
            takes=sequence.takes,
        )
        left = tm.noise.smoothing_factor(self.recipe.settings.gaussian_px)
        return np.asarray(noise.variance) * left


def describe(
    averages: FrameAverages,
    settings: ReconstructionSettings,
    *,
    coarse: FrameAverages | None = None,
    ambient_dn_per_s: float | None = None,
) -> SceneStatistics | None:
    """Describe the scene that frames show.

    Parameters
    ----------
    averages
        The frames with the highest frequencies.
    settings
        Biasing and threshold.
    coarse
        Frames at a low frequency, for ambient light and ambiguity of the range.
    ambient_dn_per_s
        Light that is not the camera's, where that is known.

    Returns
    -------
    SceneStatistics or None
        None where no pixel has light.
    """
    lit = lit_pixels(averages)
    if coarse is not None:
        lit &= lit_pixels(coarse)
        coarse = _kept(coarse)
    moving = moving_share(averages, lit) if lit.any() else 0.0
    seen = partial(_described, _kept(averages), settings, coarse, ambient_dn_per_s, lit, moving)
    scene = seen()
    return None if scene is None else replace(scene, seen=seen, shape=lit.shape)


def _kept(averages: FrameAverages) -> FrameAverages:
    """Return what other pixels of the same frames are described by."""
    nothing = averages.moved[:0]
    recipe = replace(averages.recipe)  # without what it keeps, which no process can be sent
    return replace(averages, recipe=recipe, moved=nothing, single=nothing)


def _described(
    averages: FrameAverages,
    settings: ReconstructionSettings,
    coarse: FrameAverages | None,
    ambient_dn_per_s: float | None,
    lit: _Array,
    moving: float,
    within: _Array | None = None,
    *,
    every: bool = False,
) -> SceneStatistics | None:
    """Describe typical lit pixels, or every one of them, of those within (H, W)."""
    lit = lit if within is None else lit & within
    if not lit.any():
        return None
    there = np.flatnonzero(lit)
    pixels = there if every else there[typical_pixels(averages.at(there)[0], PIXELS)]
    b, mean_dn = averages.at(pixels)
    variance = averages.variance(mean_dn) / averages.frames
    base_hz = averages.recipe.base_frequency_hz
    direct_m, uncertainty_m = direct_range(b, variance, base_hz, settings)
    earliest_m, latest_m = direct_m, direct_m
    if not every:  # of maps nobody asks for it
        earliest_m, latest_m = _plausible_by_kind(b, variance, base_hz, direct_m, uncertainty_m)
    light_dn = _brightness(b if coarse is None else coarse.at(pixels)[0], b)
    checked = coarse is not None
    if coarse is not None:
        wrapped_m, direct_m = direct_m, _unwrapped(direct_m, b, coarse, pixels, base_hz)
        earliest_m, latest_m = (each + direct_m - wrapped_m for each in (earliest_m, latest_m))
    if ambient_dn_per_s is None:
        # an image holds, on average over four phases, dark + ambient + b_0 / 2
        ambient = np.maximum(mean_dn - light_dn / 2, 0.0) / averages.exposure_s
    else:
        ambient = np.full(pixels.size, ambient_dn_per_s)
    relative = (b / light_dn).astype(np.complex64)
    relative[0] = 1.0
    returns = tm.pisarenko(relative)
    weight = np.asarray(returns.weight, dtype=float)
    phase = np.asarray(returns.phase_rad, dtype=float)
    return SceneStatistics(
        brightness_dn_per_s=light_dn / averages.exposure_s,
        ambient_dn_per_s=ambient,
        brightest_dn_per_s=averages.brightest_dn(within) / averages.exposure_s,
        direct_m=direct_m,
        uncertainty_m=uncertainty_m,
        earliest_m=earliest_m,
        latest_m=latest_m,
        delay_s=np.where(weight > 0, phase / (2 * np.pi * base_hz), np.nan),
        share=weight / np.maximum(1.0, weight.sum(axis=0)),
        base_frequency_hz=base_hz,
        measured=relative,
        relative_noise=np.sqrt(variance[1]) / light_dn,
        lit_share=float((lit if within is None else lit[within]).mean()),
        dim_share=dim_share(light_dn, direct_m),
        moving_share=moving,
        ambiguity_checked=checked,
        pixels=pixels,
    )


def _plausible_by_kind(
    b: _Array, variance: _Array, base_hz: float, direct_m: _Array, uncertainty_m: _Array
) -> tuple[_Array, _Array]:
    """Return `plausible_ranges` (P), looked for in one pixel of each kind."""
    few = one_of_each(direct_m.size)
    bounds_m = plausible_ranges(
        b[:, few], variance[:, few], base_hz, direct_m[few], uncertainty_m[few]
    )
    earliest_m, latest_m = (
        direct_m + np.repeat(each - direct_m[few], STRATUM) for each in bounds_m
    )
    return earliest_m, latest_m


def lit_pixels(averages: FrameAverages) -> _Array:
    """Return which pixels (H, W) have modulated light that noise alone does not explain.

    The sum of squares of 2 m independent parts over their variance is chi-square; it must be above
    its mean by `LIT_DEVIATIONS` of its standard deviations, 2 sqrt(m) each. Smoothing would leak
    the light of neighbours into unlit pixels. A longer look lights no more of them: what a plan is
    for does not depend on how long the scene was looked at.
    """
    b = averages.single[1:]
    m = len(b)
    left = tm.noise.smoothing_factor(averages.recipe.settings.gaussian_px)
    variance = averages.variance(averages.mean_dn)[1:] / (left * min(averages.frames, LIT_FRAMES))
    with np.errstate(invalid="ignore"):  # of pixels that are not finite
        power = (np.abs(b) ** 2 / variance).sum(axis=0)
        lit: _Array = averages.usable & (power > 2 * m + LIT_DEVIATIONS * 2 * np.sqrt(m))
    return lit


def dim_share(light: _Array, range_m: _Array) -> float:
    """Return the share of pixels (P) that may be lit by other surfaces alone.

    Those with less than `DIM` of the light of bright ones, both as if they were at one range. Their
    light may come around a corner of the scene, and nothing in their moments shows that.
    """
    at_one_range = light * range_m**2
    bright = np.quantile(at_one_range, BRIGHT_SHARE)
    return float((at_one_range < DIM * bright).mean())


def _brightness(low: _Array, b: _Array) -> _Array:
    """Return b_0 (P): the modulus at the lowest frequency, and no less than at any other."""
    size: _Array = np.maximum(np.abs(low[1]), np.abs(b[1:]).max(axis=0)).astype(float)
    return np.maximum(size, 1e-9)


def _unwrapped(
    direct_m: _Array, b: _Array, coarse: FrameAverages, pixels: _Array, base_hz: float
) -> _Array:
    """Add the periods that the mean of all light lies beyond, by the coarse frequency."""
    coarse_b, _ = coarse.at(pixels)
    coarse_hz = coarse.recipe.base_frequency_hz
    period_m = tm.SPEED_OF_LIGHT_M_S / (2 * base_hz)
    far_m = tm.SPEED_OF_LIGHT_M_S / (2 * coarse_hz)
    mean_m = np.remainder(np.angle(b[1]), 2 * np.pi) / (2 * np.pi) * period_m
    coarse_m = np.remainder(np.angle(coarse_b[1]), 2 * np.pi) / (2 * np.pi) * far_m
    periods = np.maximum(np.round((coarse_m - mean_m) / period_m), 0)
    mean_m = mean_m + periods * period_m
    before_m = np.remainder(mean_m - direct_m, period_m)
    before_m = np.where(before_m > _EARLY * period_m, before_m - period_m, before_m)
    return np.asarray(np.maximum(mean_m - before_m, 0.0))


def moving_share(averages: FrameAverages, lit: _Array) -> float:
    """Return the share of lit pixels (H, W) whose first and last frame differ beyond noise."""
    if averages.frames < 2:
        return 0.0
    apart = np.abs(averages.moved[1:]) ** 2
    m = len(apart)
    with np.errstate(invalid="ignore"):
        power = (apart / (2 * averages.variance(averages.mean_dn)[1:])).sum(axis=0)
    return float((power > 2 * m + MOVED_DEVIATIONS * 2 * np.sqrt(m))[lit].mean())
