"""Averaging over neighbouring pixels as the settings have it."""

from collections.abc import Callable, Sequence
from functools import partial, reduce
from operator import or_

import numpy as np

from transientcam_compiled import Spread
from transientcam_moments.arrays import Array, namespace
from transientcam_moments.images import smooth
from transientcam_moments.noise import (
    CapturedImages,
    ImageNoise,
    MomentNoise,
    Sensor,
    average_neighbours,
    moment_noise,
)
from transientcam_moments.reconstruction._settings import Settings


def over_neighbours(
    moments: Array,
    settings: Settings,
    calibration: Array | None,
    left_out: Sequence[Array | None],
    images: CapturedImages | None,
    spread: Spread,
) -> tuple[Array, Array | None]:
    """Average calibrated moments (m + 1, ...) over neighbours.

    Pixels of the masks ``left_out`` count for no other one, but to a Gaussian. Returns the share
    (H, W) of each pixel's own variance that is left, too; None of a Gaussian, or without images.
    """
    sensor = settings.sensor
    noise_of = sensor_noise(settings, sensor, calibration, len(moments))
    if moments.ndim != 3 or not settings.keeps_edges or sensor is None or noise_of is None:
        px = settings.gaussian_px if moments.ndim == 3 else 0.0
        return (smooth(moments, px) if px > 0 else moments), None
    measured = settings.zeroth != "estimated"
    brightness = moments[0].real if measured else abs(moments[1:]).max(axis=0)
    ambient = None if images is None else images.ambient(brightness, sensor)
    noise = noise_of(brightness) if ambient is None else noise_of(brightness, ambient=ambient)
    masks = [namespace(moments).asarray(each) for each in left_out if each is not None]
    found = average_neighbours(
        moments,
        noise,
        multiples=None if settings.multiples is None else (0, *settings.multiples),
        left_out=reduce(or_, masks) if masks else None,
        spread=spread,
    )
    return found.moments, found.share


def sensor_noise(
    settings: Settings, sensor: Sensor | ImageNoise | None, calibration: Array | None, planes: int
) -> Callable[..., MomentNoise] | None:
    """Return what tells noise of brightness and ambient light; None where it is not known."""
    if sensor is None or settings.zeroth is None or settings.takes is None:
        return None
    return partial(
        moment_noise,
        sensor=sensor,
        calibration=np.ones(planes) if calibration is None else calibration,
        zeroth=settings.zeroth,
        takes=settings.takes,
        phases_rad=settings.sampled_rad,
    )
