"""From the moments of a look to the statistics of a scene."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.imaging import Recipe, nominal_gains
from transientcam_server.planning._scene.estimation import direct_range
from transientcam_server.planning._scene.plausible import plausible_ranges
from transientcam_server.planning._scene.scene import (
    PIXELS,
    STRATUM,
    SceneStatistics,
    one_of_each,
    typical_pixels,
)
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
LIT_DEVIATIONS: Final = 5.0
"""Standard deviations that the light of a lit pixel stands clear of noise by."""
LIT_FRAMES: Final = 8
"""Frames whose noise it is, at most."""
MOVED_DEVIATIONS: Final = 5.0
UNSTEADY: Final = 1.5
"""Variance between frames over that of noise, from which on a pixel moves: repaired images have
more noise."""
LEAST_CONTRAST: Final = 0.2
"""Frequencies that a device modulates less than so much are left to predictions by a model."""
LEAST_STILL: Final = 0.1
"""Share of the lit pixels that has to stand still for the others to be left out."""
_EARLY: Final = 0.9
"""Share of a period by which a direct return may come before the mean of all light."""
NOISIER: Final = 3
"""Draws that show what the noise of a single frame adds to what seems to be bias."""
DIM: Final = 0.2
"""What a surface gets from a lit one beside it, over what that one gets, is hardly more."""
BRIGHT_SHARE: Final = 0.95
"""All but the brightest pixels, which may be a mirror's."""
BRIGHTEST_SHARE: Final = 0.999
"""Share of the pixels that nothing planned may saturate."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameAverages:
    """What frames of one sequence show.

    ``recipe``, ``sensor``: How they were captured.
    ``frames``: How many.
    ``moments``: (m + 1, H, W) smoothed moments, averaged over the frames.
    ``first``, ``last``: (m + 1, H, W) smoothed moments of these frames.
    ``scatter``: (m + 1, H, W) variance of smoothed moments between frames, of both parts together.
    ``temperature_c``: Of the camera; None where that is not known.
    ``single``: (m + 1, H, W) moments that are not smoothed, averaged over the frames.
    ``mean_dn``: (H, W) mean of all four-bucket images above the dark level.
    ``highest_dn``: (H, W) the most that an image holds above the dark level.
    ``usable``: (H, W) which pixels are not saturated.
    ``ideal``: Whether the device is known to be what nominal gains take it for.
    """

    recipe: Recipe
    sensor: tm.noise.Sensor
    frames: int
    moments: _Array
    first: _Array
    last: _Array
    scatter: _Array
    temperature_c: float | None
    single: _Array
    mean_dn: _Array
    highest_dn: _Array
    usable: _Array
    ideal: bool = False

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

        ``signal_dn``: (...) mean of the images above the dark level, ambient light included.
        """
        sequence = self.recipe.applied.sequence
        noise = tm.noise.moment_noise(
            2 * np.maximum(signal_dn, 0.0),
            self.sensor,
            calibration=nominal_gains(sequence) * self.contrast,
            zeroth=sequence.zeroth,
            takes=sequence.takes,
        )
        left = tm.noise.smoothing_factor(self.recipe.settings.gaussian_px)
        return np.asarray(noise.variance) * left

    @property
    def contrast(self) -> _Array:
        """What the device leaves of its modulation (m + 1), over the nominal: median pixel."""
        return np.median(np.abs(self._relative_gains()), axis=(1, 2))

    @property
    def uncalibrated_m(self) -> float:
        """How far nominal gains put the range of the median pixel off; 0 where they are used."""
        relative = self._relative_gains()
        if relative.shape[1:] != self.mean_dn.shape:
            return 0.0
        smoothed = tm.smooth(relative.astype(np.complex64), self.recipe.settings.gaussian_px or 0.5)
        off_rad = np.median(np.abs(np.angle(smoothed[1])))
        return float(tm.range_m(off_rad, self.recipe.base_frequency_hz))

    def _relative_gains(self) -> _Array:
        """Return the gains in use over the nominal ones, (m + 1, H, W) or of one pixel."""
        nominal, gains = self.recipe.nominal_gains[:, None, None], self.recipe.gains
        return np.ones_like(nominal) if gains is None else gains.planes / nominal

    @property
    def calibrated(self) -> bool:
        """Whether the moments are known to be the scene's: nominal gains may be off."""
        return self.ideal or self.recipe.gains is not None


def describe(
    averages: FrameAverages,
    settings: ReconstructionSettings,
    *,
    coarse: FrameAverages | None = None,
    ambient_dn_per_s: float | None = None,
    gain_noise: float = 0.0,
    quick: Sequence[FrameAverages] = (),
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
    gain_noise
        Variance that the gains of the calibration add to that of a frame, over it.
    quick
        Two frames of one frequency in succession each, of what moves.

    Returns
    -------
    SceneStatistics or None
        None where no pixel has light.
    """
    lit, moving = lit_pixels(averages), moving_pixels(averages)
    if coarse is not None:
        lit &= lit_pixels(coarse)
        moving |= moving_pixels(coarse)
        coarse = _kept(coarse)
    swings = _swings_m_per_s(quick) if quick else None
    arguments = settings, coarse, ambient_dn_per_s, gain_noise, swings, lit, moving
    seen = partial(_described, _kept(averages), *arguments)
    scene = seen()
    return None if scene is None else replace(scene, seen=seen, shape=lit.shape)


def _kept(averages: FrameAverages) -> FrameAverages:
    """Return what other pixels of the same frames are described by."""
    nothing = averages.first[:0]
    recipe = replace(averages.recipe)  # without what it keeps, which no process can be sent
    return replace(
        averages, recipe=recipe, first=nothing, last=nothing, scatter=nothing, single=nothing
    )


def _described(
    averages: FrameAverages,
    settings: ReconstructionSettings,
    coarse: FrameAverages | None,
    ambient_dn_per_s: float | None,
    gain_noise: float,
    swings_m_per_s: _Array | None,
    lit: _Array,
    moving: _Array,
    within: _Array | None = None,
    *,
    every: bool = False,
) -> SceneStatistics | None:
    """Describe typical lit pixels, or every one of them, of those within (H, W)."""
    lit = lit if within is None else lit & within
    if not lit.any():
        return None
    moving_share = float(moving[lit].mean())
    # what moves is another thing at each frequency, and beyond any range between two of them
    still = moving_share <= 1 - LEAST_STILL
    there = np.flatnonzero(lit & ~moving if still and not every else lit)
    pixels = there if every else there[typical_pixels(averages.at(there)[0], PIXELS)]
    b, mean_dn = averages.at(pixels)
    base_hz, picture = averages.recipe.base_frequency_hz, averages.moments
    variance = averages.variance(mean_dn) * (1 / averages.frames + gain_noise)
    light_dn = _brightness(b if coarse is None else coarse.at(pixels)[0], b)
    contrast = averages.contrast
    if not averages.calibrated:
        contrast = contrast_of_picture(b, variance)
        b, variance = b / contrast[:, None], variance / contrast[:, None] ** 2
        picture = picture / contrast[:, None, None]
    if coarse is not None and not still:
        b = _of_one_return(b, coarse, pixels, base_hz)
    told = 1 + int(np.flatnonzero(contrast >= LEAST_CONTRAST)[-1])
    b, variance = b[:told], variance[:told]

    def told_by(b: _Array) -> dict[str, Any]:
        direct_m, uncertainty_m = direct_range(b, variance, base_hz, settings)
        relative = (b / light_dn).astype(np.complex64)
        relative[0] = 1.0
        returns = tm.pisarenko(relative)
        weight = np.asarray(returns.weight, dtype=float)
        phase = np.asarray(returns.phase_rad, dtype=float)
        return {
            "direct_m": direct_m,
            "uncertainty_m": uncertainty_m,
            "delay_s": np.where(weight > 0, phase / (2 * np.pi * base_hz), np.nan),
            "share": weight / np.maximum(1.0, weight.sum(axis=0)),
            "measured": relative,
        }

    shape: dict[str, Any] = told_by(b)
    direct_m, uncertainty_m = shape["direct_m"], shape["uncertainty_m"]
    again: tuple[dict[str, Any], ...] = ()
    if coarse is None and not every:
        noise, random = tm.noise.MomentNoise(variance), np.random.default_rng(0)
        drawn = tm.noise.draw(b, noise, random, draws=NOISIER)
        again = tuple(told_by(drawn[:, draw]) for draw in range(NOISIER))
    earliest_m, latest_m = direct_m, direct_m
    if not every:  # of maps nobody asks for it
        earliest_m, latest_m = _plausible_by_kind(b, variance, base_hz, direct_m, uncertainty_m)
    checked = coarse is not None
    if coarse is not None:
        wrapped_m, direct_m = direct_m, _unwrapped(direct_m, b, coarse, pixels, base_hz)
        shape["direct_m"] = direct_m
        earliest_m, latest_m = (each + direct_m - wrapped_m for each in (earliest_m, latest_m))
    if ambient_dn_per_s is None:
        # an image holds, on average over four phases, dark + ambient + b_0 / 2
        ambient = np.maximum(mean_dn - light_dn / 2, 0.0) / averages.exposure_s
    else:
        ambient = np.full(pixels.size, ambient_dn_per_s)
    return SceneStatistics(
        **shape,
        brightness_dn_per_s=light_dn / averages.exposure_s,
        ambient_dn_per_s=ambient,
        brightest_dn_per_s=averages.brightest_dn(within) / averages.exposure_s,
        earliest_m=earliest_m,
        latest_m=latest_m,
        again=again,
        base_frequency_hz=base_hz,
        relative_noise=np.sqrt(variance[1]) / light_dn,
        lit_share=float((lit if within is None else lit[within]).mean()),
        dim_share=dim_share(light_dn, direct_m),
        moving_share=moving_share,
        ambiguity_checked=checked,
        contrast=tuple(contrast.tolist()),
        uncalibrated_m=averages.uncalibrated_m,
        calibrated=averages.calibrated,
        swing_m_per_s=(
            None if swings_m_per_s is None else _typical_swings(swings_m_per_s[:, lit], pixels.size)
        ),
        pixels=pixels,
        picture=(picture[:told] / averages.exposure_s).astype(np.complex64),
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


def moving_pixels(averages: FrameAverages) -> _Array:
    """Return which pixels (H, W) differ from frame to frame, or in the end, beyond noise."""
    m, apart = len(averages.scatter) - 1, averages.frames - 1
    if not apart:
        return np.zeros(averages.usable.shape, dtype=bool)
    variance = averages.variance(averages.mean_dn)[1:]
    with np.errstate(invalid="ignore"):
        moved = (np.abs(averages.last - averages.first)[1:] ** 2 / (2 * variance)).sum(axis=0)
        between = apart * (averages.scatter[1:] / variance).sum(axis=0)
        found: _Array = (moved > _most(2 * m)) | (between > UNSTEADY * _most(2 * m * apart))
    return found


def _most(freedom: int) -> float:
    """Return what chi-square with so many degrees of freedom does not exceed by noise."""
    return freedom + MOVED_DEVIATIONS * float(np.sqrt(2 * freedom))


def contrast_of_picture(b: _Array, variance: _Array) -> _Array:
    """Return what a device that is not calibrated leaves of its modulation (m + 1), at most 1.

    What all pixels (P) lose alike is the device's, not the scene's: of the brighter half a quarter
    is taken for single returns.
    """
    size = np.sqrt(np.maximum(np.abs(b) ** 2 - 2 * variance, 0.0))
    bright = np.abs(b[1]) >= np.median(np.abs(b[1]))
    kept = np.quantile((size / np.maximum(size[1], 1e-9))[:, bright], 0.75, axis=1)
    return np.asarray(np.clip(np.concatenate([[1.0], kept[1:]]), 0.01, 1.0))


def _of_one_return(b: _Array, coarse: FrameAverages, pixels: _Array, base_hz: float) -> _Array:
    """Return moments (m + 1, P) of one return each, at the range of the coarse frames."""
    coarse_b, _ = coarse.at(pixels)
    phase = np.remainder(np.angle(coarse_b[1]), 2 * np.pi)
    phase = phase * base_hz / coarse.recipe.base_frequency_hz
    j = np.arange(len(b))[:, None]
    return np.asarray(np.abs(coarse_b[1]) * np.exp(1j * j * phase), b.dtype)


def _swings_m_per_s(quick: Sequence[FrameAverages]) -> _Array:
    """Return how fast ranges change between two frames (K, H, W), beyond what noise does."""
    swings_m_per_s = []
    for two in quick:
        size = np.maximum(np.abs(two.moments[1]), 1e-9)
        noise = MOVED_DEVIATIONS * np.sqrt(2 * two.variance(two.mean_dn)[1]) / size
        turned = np.angle(two.last[1] * np.conj(two.first[1]))
        beyond = np.nan_to_num(np.sqrt(np.maximum(turned**2 - noise**2, 0.0)))
        swing_m = np.asarray(tm.range_m(beyond, two.recipe.base_frequency_hz))
        swings_m_per_s.append(swing_m * two.recipe.applied.frame_rate_hz)
    return np.stack(swings_m_per_s)


def _typical_swings(swings_m_per_s: _Array, count: int) -> _Array:
    """Return how fast so many pixels change that stand for those given (K, N), by chance.

    When more of them do. Twice as many as there are: captures in succession see edges elsewhere.
    """
    place = 1 - (np.arange(count) + 0.5) / (2 * count)
    return np.random.default_rng(0).permutation(np.quantile(swings_m_per_s, place))
