"""Averaging over neighbouring pixels as the settings have it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
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
    image_noise,
    moment_noise,
)
from transientcam_moments.reconstruction._settings import Settings


def known_noise(
    moments: Array, settings: Settings, images: CapturedImages | None
) -> Sensor | ImageNoise | None:
    """Return the noise of images as it is stated, or shown by them; nothing is smoothed yet."""
    if settings.sensor is not None or images is None:
        return settings.sensor
    return image_noise(images, measured_brightness(moments, settings))


def applicable(settings: Settings, known: Sensor | ImageNoise | None) -> Settings:
    """Return the settings with an average that the known noise allows."""
    blind = settings.neighbours == "edge-preserving" and known is None
    return replace(settings, neighbours="gaussian") if blind else settings


def over_neighbours(
    moments: Array, settings: Settings, known: Sensor | ImageNoise | None,
    calibration: Array | None, left_out: Sequence[Array | None], images: CapturedImages | None,
    spread: Spread, frames: Array | None = None,
) -> tuple[Array, Array | None]:  # fmt: skip
    """Average calibrated moments (m + 1, ...) over neighbours.

    By settings that are `applicable` with the known noise of the images. Pixels of the masks
    ``left_out`` count for no other one, but to a Gaussian; ``frames`` are how many frames (H, W)
    each is the mean of. Returns the share (H, W) that is left of the variance
    that one frame has by itself, or after the Gaussian, too; None of one frame and a Gaussian.
    """
    if images is not None and images.variance is not None:  # as the mean of less than one frame
        frames = (1 if frames is None else frames) / images.variance
    noise = None
    if moments.ndim == 3 and settings.neighbours == "edge-preserving":
        noise = measured_noise(moments, settings, known, calibration, images)
    if noise is None:
        px = settings.gaussian_px if moments.ndim == 3 else 0.0
        share = None if frames is None else 1 / frames
        if px == 0:
            return moments, share
        if share is not None:  # as of noise that is the same all around
            share = smooth(share[None], px / math.sqrt(2))[0]
        return smooth(moments, px), share
    if frames is not None:
        noise = MomentNoise(noise.variance / frames)
    masks = [namespace(moments).asarray(each) for each in left_out if each is not None]
    if images is not None and images.saturated_pixels is not None:  # recovered, or NaN
        masks = [each & ~images.saturated_pixels for each in masks]
    found = average_neighbours(
        moments,
        noise,
        multiples=None if settings.multiples is None else (0, *settings.multiples),
        left_out=reduce(or_, masks) if masks else None,
        frames=frames,
        spread=spread,
    )
    return found.moments, found.share if frames is None else found.share / frames


def measured_noise(
    moments: Array, settings: Settings, sensor: Sensor | ImageNoise | None,
    calibration: Array | None, images: CapturedImages | None, ambient_dn: float = 0.0,
) -> MomentNoise | None:  # fmt: skip
    """Return the noise of moments of one frame, each pixel by itself; None if it isn't known."""
    noise_of = sensor_noise(settings, sensor, calibration, len(moments))
    if noise_of is None or sensor is None:
        return None
    brightness = measured_brightness(moments, settings)
    ambient = ambient_dn if images is None else images.ambient(brightness, sensor)
    return noise_of(brightness, ambient=0.0 if ambient is None else ambient)


def measured_brightness(moments: Array, settings: Settings) -> Array:
    """Return b_0, or what is known of it where it was not measured."""
    measured = settings.zeroth != "estimated"
    return moments[0].real if measured else abs(moments[1:]).max(axis=0)


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
