"""Stages of a reconstruction: what a frame computes of it in one go, and what follows from that."""

import logging
import math
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import Final, cast

import numpy as np

import transientcam_moments as tm
from transientcam.documents import FramesAveragedDocument, PixelCountsDocument, PredictedStdDocument
from transientcam_driver import RawFrame
from transientcam_server.imaging._errors_of_range.noise import contradictions, range_noise
from transientcam_server.imaging._recipe.recipe import Recipe

_log = logging.getLogger("transientcam_server.imaging.stages")

STAGES: Final[dict[str, tuple[str, ...]]] = {
    "light": ("flags", "validity", "brightness"),
    "moments": ("moments",),
    "returns": ("returns", "direct", "range_m"),
    "coefficients": ("coefficients",),
    "misfit": ("reduced_chi_square",),
}
"""Properties of `tm.Reconstruction` that each stage computes, in the order they build on."""
_BITS: Final = {str(flag.name).lower(): np.uint8(flag) for flag in tm.Flags if flag}
LEAST_SPREAD_PIXELS: Final = 1 << 16
"""Of a frame that one core computes for much longer than its parts take to begin and to end."""
OF_ESTIMATOR: Final = "returns"
"""The stage that the settings' estimator computes."""
FIRST: Final = "light"
"""The stage that all others build on."""


@dataclass(slots=True)
class Computed:
    """The reconstruction of one frame, as far as it was computed."""

    reconstruction: tm.Reconstruction | None = None
    """None before the first stage, or where that failed."""
    failures: dict[str, Exception] = field(default_factory=dict)
    """Of the stages that were requested last."""
    pixels: PixelCountsDocument | None = None
    """How many pixels carry each flag."""
    ambient_dn: float | None = None
    """Light in DN an image that is not the camera's, in the median pixel; None without a sensor."""
    frames_averaged: FramesAveragedDocument | None = None
    """How many frames a pixel rests on; None where frames are not averaged."""
    range_noise: PredictedStdDocument | None = None
    """Predicted deviation of the range, as the metadata have it; None before the returns."""


def compute(
    before: Computed,
    recipe: Recipe,
    raw: RawFrame,
    previous: RawFrame | None,
    stages: Iterable[str],
    averaged: tm.Measured | None = None,
    spread: tm.kernels.Spread = tm.kernels.at_once,
) -> Computed:
    """Compute stages of a frame; one that fails leaves the others as they are. Never raises.

    ``averaged`` is what goes on in place of the images, as of `Recipe.average`; ``spread`` is how
    compiled kernels use several threads.
    """
    requested = set(stages)
    computed = replace(before, failures={})
    try:
        if computed.reconstruction is None:
            found = recipe.reconstruct(raw, previous, averaged=averaged, spread=spread)
            computed.reconstruction = found
            _read(found, FIRST)
            contradictory = contradictions(recipe.with_noise_of(found), found)
            if contradictory is not None and contradictory.any():
                found.add_flag(tm.Flags.CONTRADICTORY, contradictory)
            computed.pixels = pixel_counts(found)
            computed.ambient_dn = _ambient_dn(recipe, found)
            computed.frames_averaged = _frames_averaged(found)
        else:
            found = computed.reconstruction
    except Exception as error:
        computed.reconstruction = None
        computed.failures = dict.fromkeys(requested, error)
        return computed
    with nullcontext() if spread is tm.kernels.at_once else tm.kernels.use_all_cores():
        for stage in requested - {FIRST}:
            try:
                _read(found, stage)
            except Exception as error:
                computed.failures[stage] = error
    recipe = recipe.with_noise_of(found)
    if recipe.sensor is not None and "returns" in requested and "returns" not in computed.failures:
        computed.range_noise = _range_noise(recipe, found, raw.number)
    return computed


def spread_of(raw: RawFrame) -> tm.kernels.Spread:
    """Return how kernels compute a new frame: on all cores where it is large, else on one."""
    large = math.prod(raw.images.shape[-2:]) >= LEAST_SPREAD_PIXELS
    return tm.kernels.over_all_cores() if large else tm.kernels.at_once


def _read(found: tm.Reconstruction, stage: str) -> None:
    """Compute the properties of a stage now, so that later readers need not."""
    for name in STAGES[stage]:
        getattr(found, name)


def pixel_counts(found: tm.Reconstruction) -> PixelCountsDocument:
    """Return how many pixels carry each flag."""
    flags = np.asarray(found.flags)
    there = np.bitwise_or.reduce(flags, axis=None)  # of most flags there are none
    counts = {"total": flags.size, "valid": flags.size - int(np.count_nonzero(flags))}
    counts |= {
        name: int(np.count_nonzero(flags & bit)) if there & bit else 0
        for name, bit in _BITS.items()
    }
    return cast("PixelCountsDocument", counts)


def _ambient_dn(recipe: Recipe, found: tm.Reconstruction) -> float | None:
    if recipe.sensor is None:
        return None
    return 0.0 if found.ambient is None else float(np.median(found.ambient))


def _frames_averaged(found: tm.Reconstruction) -> FramesAveragedDocument | None:
    if found.frames_averaged is None:
        return None
    return {
        "median": float(np.median(found.frames_averaged)),
        "least": int(found.frames_averaged.min()),
    }


def _range_noise(
    recipe: Recipe, found: tm.Reconstruction, number: int
) -> PredictedStdDocument | None:
    """Return the predicted deviation of the range; a failure of it spoils no range."""
    try:
        return range_noise(recipe, found)
    except Exception:
        _log.exception("capture %d: predicting the deviation of the range failed", number)
        return None
