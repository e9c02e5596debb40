"""Kernels for whole frames before and after the mathematics, in single precision."""

from collections.abc import Callable
from typing import Any

import numpy as np

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import inputs, outputs
from transientcam_moments._kernels.arrays import Complexes, Images, Reals
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.padding import LEAST_WIDTH, normalisation, row_length

ZEROTH = {"low-frequency": 0, "on-off": 1, "estimated": 2}


def measure_and_smooth_entry(m: int) -> Callable[..., Any]:
    """Compile the kernel of order m."""
    entry(inputs.measure, m, "f")  # which are linked
    entry(inputs.smooth, m, "f")
    return entry(inputs.measure_and_smooth, m, "f")


def measure_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the way from raw images to uncalibrated moments."""
    order, run = (0,) * m, entry(inputs.measure, m, "f")
    ones = np.ones((m + 1, LEAST_PIXELS), np.complex64)

    def kernel(images: Images, zeroth: str, *, spread: Spread = at_once) -> Any:
        pixels = images[0].size
        raw = np.ascontiguousarray(images).reshape(len(images), pixels)
        moments, saturated = empty((m + 1, pixels), np.complex64), empty(pixels, np.uint8)

        def part(start: int, stop: int) -> None:
            run(order, raw, ZEROTH[zeroth], ones, 0, 0.0, moments, saturated, start, stop)

        spread(part, pixels)
        return moments.reshape((m + 1, *images.shape[1:]))

    return kernel


def smooth_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile smoothing; the kernel gives None for
    moments that aren't finite, narrow images and other axes.
    """
    run = entry(inputs.smooth, m, "f")

    def kernel(moments: Complexes, taps: Reals, *, spread: Spread = at_once) -> Any:
        height, width = moments.shape[-2:]
        if width < LEAST_WIDTH or moments.ndim != 3:
            return None
        planes = np.ascontiguousarray(moments).reshape(len(moments), -1).view(np.float32)
        out = empty(planes.shape, planes.dtype)
        weights = taps.astype(np.float32)
        weight = normalisation(np.ones((height, width), bool), taps)
        finite: list[bool] = []

        def part(start: int, stop: int) -> None:
            row = np.zeros(row_length(width, taps.size), np.float32)
            finite.append(run(planes, weights, weight, row, out, width, start, stop))

        spread(part, height, 8)
        return out.view(np.complex64).reshape(moments.shape) if all(finite) else None

    return kernel


def separate_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the separation of direct and indirect light."""
    order, run = (0,) * m, entry(outputs.separate, m, "f")

    def kernel(weight: Reals, phase: Reals, threshold: float, *, spread: Spread = at_once) -> Any:
        shape, pixels = weight.shape[1:], weight[0].size
        angles = np.ascontiguousarray(phase).reshape(m, pixels)
        weights = np.ascontiguousarray(weight).reshape(m, pixels)
        flags = np.zeros(pixels, np.uint8)
        direct, indirect, first = (empty(pixels, np.float32) for _ in range(3))

        def part(start: int, stop: int) -> None:
            run(order, angles, weights, flags, direct, indirect, first, threshold, 1.0, start, stop)

        spread(part, pixels)
        return direct.reshape(shape), indirect.reshape(shape), first.reshape(shape)

    return kernel
