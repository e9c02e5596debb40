"""What the range of each pixel is worth: its interval, and why not to trust it."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam.wire import Trust
from transientcam_driver import RawFrame
from transientcam_server.imaging._recipe.recipe import Recipe

_Array = NDArray[Any]
_HALF_WIDTH: Final = 1.645
"""Of the interval that holds 90 % of a normal variable, in standard deviations."""
DRIFT_M_PER_C: Final = 0.6e-3
"""By how much the range drifts for each degree, where nothing else is known: 4 ps of delay."""
FAR_FROM_CALIBRATION_C: Final = 10.0
"""Warmer or colder by more than this, a camera is not the one that was calibrated."""
BRIGHTER_THAN_WHITE: Final = 1.5
"""Times a white surface that faces the lamp, above which light did not come directly."""


def judged(
    recipe: Recipe,
    found: tm.Reconstruction,
    std_m: _Array,
    bias_m: _Array,
    raw: RawFrame | None,
) -> tuple[_Array, _Array]:
    """Return the half width of each pixel's 90 % interval in m, and its `Trust`, (H, W)."""
    range_m = np.asarray(found.range_m, dtype=np.float64)
    seen = np.asarray(found.has_range)
    warmer_c = warmer_than_calibrated_c(recipe, raw)
    drift_m = 0.0 if warmer_c is None else DRIFT_M_PER_C * abs(warmer_c)
    error_m = _HALF_WIDTH * np.sqrt(std_m**2 + bias_m**2 + drift_m**2)
    reasons = {
        Trust.NO_RANGE: ~seen,
        Trust.CORRUPT_IMAGE: np.full(seen.shape, bool(found.unrepaired_images)),
        Trust.NO_DIRECT_LIGHT: too_bright(recipe, range_m, np.asarray(found.brightness)),
        Trust.DRIFT: np.full(seen.shape, abs(warmer_c or 0.0) > FAR_FROM_CALIBRATION_C),
    }
    trust = np.select(list(reasons.values()), list(reasons), Trust.TRUSTED).astype(np.uint8)
    return error_m.astype(np.float32), trust


def warmer_than_calibrated_c(recipe: Recipe, raw: RawFrame | None) -> float | None:
    """Return how much warmer the camera is than at its calibration; None where that is unknown."""
    calibrated_c = None if recipe.gains is None else recipe.gains.temperature_c
    now_c = None if raw is None else raw.temperature_c
    return None if calibrated_c is None or now_c is None else now_c - calibrated_c


def too_bright(recipe: Recipe, range_m: _Array, brightness_dn: _Array) -> _Array:
    """Return where no surface at this range can be this bright by the lamp's own light."""
    if recipe.lamp is None:
        return np.zeros(range_m.shape, dtype=bool)
    points_m = recipe.lens(*range_m.shape).points(range_m)
    white_dn = recipe.lamp.white_dn_per_s(points_m) * recipe.applied.sequence.exposure_s
    return np.asarray(brightness_dn > BRIGHTER_THAN_WHITE * white_dn)
