"""What the range of each pixel is worth: its interval, and why not to trust it."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam.wire import Trust
from transientcam_driver import RawFrame
from transientcam_driver.calibration import TemperatureDrift
from transientcam_moments.images import gaussian_taps
from transientcam_server.imaging._errors_of_range.evidence import (
    NEIGHBOURS_PX,
    SHADOW,
    brighter_than_white,
    edges_and_strays,
    mean_alike,
    median_around,
    moved,
    shadowed,
)
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.imaging._recipe.recipe import Recipe

_Array = NDArray[Any]
NOISE: Final = 1.5
"""Half width of an interval by noise, in standard deviations; 1.645 hold 90 % of a normal variable,
and a deviation by draws around what is noisy already is more than it."""
TAIL_SHAPE: Final = 0.4
"""Times the share of a pixel's light that its tail has, of a radian at the highest frequency, by
which the range is off since no tail has quite the shape of the model's."""
BIAS: Final = 1.6
"""Times another estimator's disagreement with the likelihood, which later light moves, too; fewer
harmonics are off by more than all of them, so that their disagreement counts as it is."""
LEAST_BIAS: Final = 0.02
"""Of the range of a radian at the highest frequency, by which later light may move a range that
nothing shows."""
LEAST_LOSS: Final = 0.002
"""Twice the lost modulation that may be none, without noise."""
TAIL_SKEW: Final = 2.0
"""Skewness of an exponential decay, whose light comes as long after its begin as it is spread."""
LEAST_SKEW: Final = 2e-4
"""Third cumulant in cubic radians that may be none, without noise."""
MOST_SLOPE: Final = 0.02
"""Of the range a pixel: what is steeper is no surface."""
LOSS_ERRORS, SKEW_ERRORS = 1.5, 1.3
"""Standard errors of them over a surface that are none of them, either."""
FAR_FROM_CALIBRATION_M: Final = 0.015
"""A camera whose temperature may move ranges by more is not the one that was calibrated."""
_UNRESOLVED: Final = 0.5
"""Of that radian: estimators that disagree by more do not tell later light from the first."""
_LATER: Final = 0.1
"""Share of the light in later returns that are resolved."""
_OPEN: Final = 0.05
"""Of the unambiguous range: noise of more leaves the range open."""


def judged(
    recipe: Recipe, found: tm.Reconstruction, std_m: _Array, bias_m: _Array,
    raw: RawFrame | None, every_px: int = 1,
) -> tuple[_Array, _Array]:  # fmt: skip
    """Return the half width of each pixel's 90 % interval in m, and its `Trust`, (H, W).

    Noise and bias were found in one pixel of ``every_px`` rows and columns. The factors were
    chosen on random scenes; ``python -m benchmarks trust`` measures how many pixels are within on
    others (decision 8).
    """
    sequence = recipe.applied.sequence
    range_m = np.where(found.has_range, found.range_m, np.nan).astype(np.float64)
    brightness_dn = np.asarray(found.brightness, dtype=np.float64)
    known = np.isfinite(range_m)
    m = sequence.multiples[-1]
    length_m = float(tm.range_m(1.0, recipe.base_frequency_hz * m))
    # what of the disagreement is noise: it is a median over pixels, which averaging has joined
    joined = np.maximum(_averaged_pixels(found) / every_px**2, 1.0)
    joined = np.minimum(np.pi / 2 * joined / NEIGHBOURS_PX**2, 1.0)
    tail, times = np.zeros_like(range_m), BIAS
    if recipe.technique == "likelihood":
        times = 1.0
        # m - 1 harmonics are off by their noise beyond that of m; squares add up to information
        joined *= (m + 1) * (2 * m + 1) / (max(m - 1, 1) * (2 * m - 1)) - 1.0
        bias_m = bias_m * (np.asarray(found.likelihood.count) < m)  # m - 1 have no m returns at all
        with np.errstate(all="ignore"):
            tail = np.clip(np.asarray(found.likelihood.tail) / brightness_dn, 0.0, 1.0)
    then_c = None if recipe.gains is None else recipe.gains.temperature_c
    drift = TemperatureDrift.between(then_c, None if raw is None else raw.temperature_c)
    drift_m = 0.0 if drift is None else drift.range_m
    # each tells of the same later light, as far as it can: the most counts, not their sum
    later_m = np.maximum.reduce([
        TAIL_SHAPE * tail * length_m,
        times * np.sqrt(np.maximum(bias_m**2 - joined * std_m**2, 0.0)),
        np.full_like(range_m, LEAST_BIAS * length_m),
        _spread_m(recipe, found, range_m),
    ])  # fmt: skip
    error_m = np.sqrt((NOISE * std_m) ** 2 + later_m**2 + drift_m**2)
    edge, stray = edges_and_strays(range_m, std_m, brightness_dn)
    flags = np.asarray(found.flags)
    # one frequency knows nothing of later light
    disagree = np.isnan(bias_m) | (bias_m > np.maximum(_UNRESOLVED * length_m, NOISE * std_m))
    later = np.asarray(found.indirect) > _LATER * brightness_dn
    nowhere = np.zeros(known.shape, dtype=bool)
    motion = bright = nowhere
    if raw is not None and recipe.sensor is not None:
        motion = moved(raw, recipe.sensor)
    lens = recipe.lens(*known.shape)
    shadow = shadowed(lens, range_m, np.maximum(error_m, SHADOW * range_m))
    if recipe.lamp is not None:
        direct_dn = np.asarray(found.direct)  # what came around later adds to the brightness
        exposure_s = sequence.exposure_s
        bright = brighter_than_white(recipe.lamp, lens.points(range_m), direct_dn, exposure_s)
    reasons = {
        Trust.NO_RANGE: ~known,
        Trust.CORRUPT_IMAGE: nowhere | bool(found.unrepaired_images),
        Trust.MOTION: motion,
        Trust.NO_DIRECT_LIGHT: bright,
        Trust.SHADOW: shadow,
        Trust.EDGE: edge,
        Trust.LATER_LIGHT_UNRESOLVED: (disagree & ~later) | (flags & tm.Flags.UNEXPLAINED > 0),
        Trust.LATER_LIGHT: disagree,
        Trust.DRIFT: (flags & tm.Flags.CONTRADICTORY > 0) | (drift_m > FAR_FROM_CALIBRATION_M),
        Trust.NOISE: stray | (std_m > _OPEN * tm.range_m(2 * np.pi, recipe.base_frequency_hz)),
    }
    trust = np.select(list(reasons.values()), list(reasons), Trust.TRUSTED).astype(np.uint8)
    return np.where(known, error_m, np.nan).astype(np.float32), trust


def not_judged(recipe: Recipe, raw: RawFrame | None) -> tuple[str, ...]:
    """Return the reasons, by name, that nothing known of a frame could give its pixels."""
    then_c = None if recipe.gains is None else recipe.gains.temperature_c
    drift = TemperatureDrift.between(then_c, None if raw is None else raw.temperature_c)
    images = raw is not None and len(raw.images) > 0 and recipe.sensor is not None
    unknown = {
        Trust.NO_DIRECT_LIGHT: recipe.lamp is None,
        Trust.SHADOW: recipe.intrinsics is None or recipe.intrinsics.source == "assumed",
        Trust.MOTION: not images,
        Trust.DRIFT: drift is None,
    }
    return tuple(reason.name.lower() for reason, missing in unknown.items() if missing)


def _averaged_pixels(found: tm.Reconstruction) -> _Array | float:
    """Return of how many pixels (H, W) the moments of each are the mean: one over what is left."""
    if found.settings.neighbours != "edge-preserving" or found.variance_share is None:
        return float((gaussian_taps(found.settings.gaussian_px) ** 2).sum()) ** -2
    frames = 1 if found.frames_averaged is None else found.frames_averaged
    return np.asarray(1 / (found.variance_share * frames))


def _spread_m(recipe: Recipe, found: tm.Reconstruction, range_m: _Array) -> _Array:
    """Return how much nearer (H, W) than its range a pixel's first light may be, by its spread.

    Light whose times of flight have the variance s^2 and the third cumulant k loses (j s)^2 / 2 of
    its modulation at the harmonic j, and its phase there is j^3 k / 6 less than j times the mean.
    Its first part is s before the mean in a material with exponential delay (k = 2 s^3), as in two
    equal returns; 2 s^4 / k before in what sends most light directly and some much later, as rooms
    do. The lesser of both counts. Returns whose phase at the highest frequency is over half a turn
    away are taken out, but for such as noise makes.
    """
    m = recipe.applied.sequence.multiples[-1]
    if m == 1:
        return np.zeros_like(range_m)
    of = found.likelihood if recipe.technique == "likelihood" else found.returns
    phase, weight = np.asarray(of.phase_rad), np.asarray(of.weight)
    radian_m = float(tm.range_m(1.0, recipe.base_frequency_hz))
    first = range_m / radian_m
    apart = np.abs(np.remainder(phase - first + np.pi, 2.0 * np.pi) - np.pi)
    strong = weight >= found.settings.threshold * weight.max(axis=0)
    far = np.where((m * apart > np.pi) & (weight > 0) & strong, weight, 0.0)
    turn = np.exp(1j * np.nan_to_num(phase))
    lowest, highest = (
        found.smoothed[at] - (far * turn**k).sum(axis=0) for at, k in ((1, 1), (-1, m))
    )
    with np.errstate(all="ignore"):
        lost = (1.0 - np.abs(highest) / np.abs(lowest)) * 2.0 / (m**2 - 1)
        early = np.angle((lowest / np.abs(lowest)) ** m * np.conj(highest)) * 6.0 / (m**3 - m)
        after = np.angle(lowest * np.exp(-1j * first))
    typical_m, pixels = median_around(range_m), _averaged_pixels(found)
    # averaging mixes the ranges of a slope, whose variance loses modulation just as well
    slope: _Array = np.array(np.gradient(typical_m))
    slope[np.abs(slope) > MOST_SLOPE * typical_m] = 0.0
    lost -= pixels / (4 * np.pi) * (slope**2).sum(axis=0) / radian_m**2
    with np.errstate(all="ignore"):
        noise = moment_noise(recipe, found).variance
        off = pixels * sum(noise[at] / np.abs(found.smoothed[at]) ** 2 for at in (1, -1))
    telling = np.isfinite(range_m) & (off < 1.0)
    (square, of_pixels), (cube, _), (after, _), (off, _) = (
        _typical(np.where(telling, plane, np.nan), typical_m) for plane in (lost, early, after, off)
    )
    # the median over neighbours has pi / 2 times the variance of their mean
    unsure = np.sqrt(np.pi / 2 * off / np.maximum(of_pixels, 1.0))
    square = np.clip(square, 0.0, 1.0)
    none = (LOSS_ERRORS * unsure * 2.0 / (m**2 - 1)) ** 4 + (LEAST_LOSS / m**2) ** 4
    spread = np.sqrt(square * square**4 / (square**4 + none))
    unsure *= 6.0 * np.sqrt((m**2 + 1) / 2) / (m**3 - m)
    skew = np.maximum(cube - SKEW_ERRORS * unsure - LEAST_SKEW, 1e-12)
    before = np.minimum(spread, TAIL_SKEW * spread**4 / skew)
    return np.asarray(np.maximum(before - after, 0.0) * radian_m)


def _typical(plane: _Array, range_m: _Array) -> tuple[_Array, _Array]:
    """Return the mean (H, W) over 53 x 53 pixels of a surface, and of how many pixels it is."""
    near, alike = mean_alike(median_around(plane), range_m, 2)
    mean, all_alike = mean_alike(near, range_m, 10)
    return mean, 53**2 * alike * all_alike
