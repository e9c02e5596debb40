"""What a frame shows against the ranges of its pixels: motion, shadow, edges, too much light."""

import itertools
import math
from typing import Any, Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import RawFrame
from transientcam_driver.camera import Lamp
from transientcam_server.imaging._recipe.lens import Intrinsics

_Array = NDArray[Any]
NEIGHBOURS_PX: Final = 5
"""Side of the square of pixels whose median separates bias from noise."""
BRIGHTER_THAN_WHITE: Final = 1.5
"""Times a white surface that faces the lamp, above which light did not come directly."""
_GLOSS_PX: Final = 9
"""Side of the square of pixels that a highlight hardly fills."""
_MOVED_DEVIATIONS: Final = 6.0
_STILL_DEVIATIONS: Final = 2.0
"""Of the typical pixel: more in a pair of images is not motion."""
_MOVED_SHARE: Final = 0.02
"""Least change of a pixel's light that is motion: what no rounding or imperfect phase explains."""
STEP: Final = 0.05
"""Of the range, above which neighbours are not of one surface."""
_STEP_DEVIATIONS: Final = 8.0
_DIM: Final = 0.5
"""Times the brightest around, below which a pixel beside a step may have its light from there."""
SHADOW: Final = 0.02
"""Of the range, by which something has to be nearer to throw a shadow."""
_STEPS: Final = 32
"""Points on the way to the lamp at which the range map is asked."""


def around(plane: _Array, side_px: int = NEIGHBOURS_PX, step_px: int = 1) -> _Array:
    """Return the values (H, W, side^2) around each pixel and its own; NaN where none is finite.

    They are of pixels that are so many steps apart.
    """
    known = np.where(np.isfinite(plane), plane, np.nan).astype(np.float32)
    padded = np.pad(known, side_px // 2 * step_px, constant_values=np.nan)
    reach_px = (side_px - 1) * step_px + 1
    found = sliding_window_view(padded, (reach_px, reach_px))[..., ::step_px, ::step_px]
    return found.reshape((*plane.shape, -1))


def median_around(plane: _Array, step_px: int = 1) -> _Array:
    """Return the median (H, W) of the finite values around each pixel; 0 where there is none."""
    ranked = np.sort(around(plane, step_px=step_px), axis=-1)  # what is not known comes last
    count = np.isfinite(ranked).sum(axis=-1)
    middle = np.maximum(count - 1, 0) // 2
    found: _Array = np.take_along_axis(ranked, middle[..., None], axis=-1)[..., 0]
    return np.nan_to_num(found)


def mean_alike(plane: _Array, range_m: _Array, step_px: int) -> tuple[_Array, _Array]:
    """Return the mean (H, W) of the pixels so many steps apart that are about as far; 0 of none.

    And their share of all.
    """
    values, others_m = around(plane, step_px=step_px), around(range_m, step_px=step_px)
    own_m = range_m[..., None]
    alike = np.isfinite(values) & (np.abs(others_m - own_m) < STEP * own_m)
    mean = np.where(alike, values, 0.0).sum(-1) / np.maximum(alike.sum(-1), 1)
    return np.asarray(mean), np.asarray(alike.mean(axis=-1))


def spread(values: _Array) -> _Array:
    """Return how far the known ones of values (H, W, N) are apart; NaN where there are none."""
    return np.asarray(np.fmax.reduce(values, axis=-1) - np.fmin.reduce(values, axis=-1))


def brighter_than_white(
    lamp: Lamp, points_m: _Array, brightness_dn: _Array, exposure_s: float
) -> _Array:
    """Return where no surface at these points (3, H, W) can be this bright by the lamp itself.

    The albedo that brightness, range and beam imply is at most 1. Highlights are small: most of the
    pixels around that have a range have to be as bright.
    """
    with np.errstate(all="ignore"):
        albedo = brightness_dn / (lamp.white_dn_per_s(points_m) * exposure_s)
    bright = albedo > BRIGHTER_THAN_WHITE
    others = around(np.where(np.isnan(albedo), np.nan, bright), _GLOSS_PX)
    most = np.nansum(others, axis=-1) > 0.5 * np.isfinite(others).sum(axis=-1)
    return np.asarray(bright & most)


def shadowed(lens: Intrinsics, range_m: _Array, margin_m: _Array) -> _Array:
    """Return the points of a range map (H, W) between which and the lamp it has something.

    On the way to the lamp a point gets behind the map, by more than a margin (H, W), and then
    through it.
    """
    points = lens.points(range_m).astype(np.float64)
    lamp_m = np.reshape(lens.lens.light_m, (3, 1, 1))
    behind_before, map_before = np.zeros(range_m.shape, dtype=bool), range_m
    found = behind_before
    for step in range(1, _STEPS):
        x, y, z = points + step / _STEPS * (lamp_m - points)
        with np.errstate(all="ignore"):
            row, column = np.rint(lens.fy * y / z + lens.cy), np.rint(lens.fx * x / z + lens.cx)
        inside = (z > 0) & (row >= 0) & (row < len(range_m))
        inside &= (column >= 0) & (column < range_m.shape[1])
        there = tuple(np.where(inside, at, 0).astype(int) for at in (row, column))
        map_m, to_lamp = range_m[there], np.stack([x, y, z]) - lamp_m
        far_m = (np.sqrt(x * x + y * y + z * z) + np.linalg.norm(to_lamp, axis=0)) / 2.0
        limit_m = np.maximum(margin_m, margin_m[there])
        # through the map, and not past the edge of something nearer
        through = behind_before & inside & (far_m < map_m)
        found = found | through & (np.abs(map_m - map_before) < limit_m)
        behind_before, map_before = inside & (far_m > map_m + limit_m), map_m
    return found


def edges_and_strays(
    range_m: _Array, std_m: _Array, brightness_dn: _Array
) -> tuple[_Array, _Array]:
    """Return the pixels (H, W) where near and far meet, and those unlike all around them.

    Near and far meet where the median range has a step, and in dim pixels beside a step or pixels
    without a range: what is bright there shines into them.
    """
    step_m = np.maximum(STEP * range_m, _STEP_DEVIATIONS * median_around(std_m))
    known = np.isfinite(range_m)
    typical_m = np.where(known, median_around(range_m), np.nan)
    light = around(np.where(known, brightness_dn, np.nan))
    dim = brightness_dn < _DIM * np.fmax.reduce(light, axis=-1)
    beside = (spread(around(range_m)) > step_m) | np.isnan(light).any(axis=-1)
    edge = (spread(around(typical_m, 3)) > step_m) | (dim & beside)
    stray = np.abs(range_m - typical_m) > step_m
    return np.asarray(known & edge), np.asarray(known & stray)


def moved(raw: RawFrame, sensor: tm.noise.Sensor) -> _Array:
    """Return where light changed during a capture, by images at opposite phases; False if unknown.

    Two images of one frequency at opposite phases have all light in their sum, whatever its time
    of flight, so that all such sums are equal. A pair that differs in the typical pixel is out of
    step, or has other light, and shows no motion.
    """
    lit = [each for each in raw.labels if each.kind == "modulated" and each.harmonic > 0]
    pairs = [
        (one.index, other.index)
        for one, other in itertools.combinations(lit if len(raw.images) else (), 2)
        if (one.take, one.harmonic) == (other.take, other.harmonic)
        and math.cos(one.phase_rad - other.phase_rad) < -0.999
    ]
    if len(pairs) < 3:
        return np.zeros(raw.images.shape[-2:], dtype=bool)
    sums = np.stack([raw.images[one].astype(np.float32) + raw.images[two] for one, two in pairs])
    middle = np.median(sums, axis=0)
    light = np.maximum(middle - 2 * sensor.dark_dn, 1.0)
    variance = light / sensor.gain_e_per_dn + 2 * (sensor.read_noise_e / sensor.gain_e_per_dn) ** 2
    off, std = np.abs(sums - middle), np.sqrt(variance)
    beyond = off > np.maximum(_MOVED_DEVIATIONS * std, _MOVED_SHARE * light)
    in_step = np.median(off / std, axis=(1, 2)) < _STILL_DEVIATIONS
    clipped = raw.images.max(axis=0) >= sensor.highest_dn  # which takes from a sum, too
    return np.asarray(beyond[in_step].any(axis=0) & ~clipped)
