"""Lanes for what happens to whole frames before and after the mathematics, in single precision."""

from collections.abc import Callable
from typing import Any

import numpy as np

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import inputs, outputs
from transientcam_moments._kernels.arrays import Complexes, Images, Reals
from transientcam_moments._kernels.compiled_entry import (
    BYTES,
    IMAGES,
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.padding import LEAST_WIDTH, normalisation, row_length

ZEROTH = {"low-frequency": 0, "on-off": 1, "estimated": 2}
_REAL, _COMPLEX = real_arrays("f"), complex_arrays("f")


def measure_entry(m: int) -> Callable[..., Any]:
    """Compile the kernel of order m."""
    return entry(
        inputs.measure,
        order_type(m), IMAGES, PIXELS, _COMPLEX[2], PIXELS, REAL, _COMPLEX[2], BYTES, PIXELS,
        PIXELS,
    )  # fmt: skip


def smooth_entry() -> Callable[..., Any]:
    """Compile the kernel of all orders."""
    plane, planes = _REAL[1], _REAL[2]
    return entry(inputs.smooth, planes, plane, plane, plane, planes, PIXELS, PIXELS, PIXELS)


def measure_and_smooth_entry(m: int) -> Callable[..., Any]:
    """Compile the kernel of order m."""
    measure_entry(m)  # which are linked
    smooth_entry()
    plane, planes = _REAL[1], _REAL[2]
    return entry(
        inputs.measure_and_smooth,
        order_type(m), IMAGES, PIXELS, _COMPLEX[2], PIXELS, REAL, _COMPLEX[2], BYTES,
        plane, plane, plane, planes, planes, PIXELS, PIXELS, PIXELS,
    )  # fmt: skip


def separate_entry(m: int) -> Callable[..., Any]:
    """Compile the kernel of order m."""
    plane, planes = _REAL[1], _REAL[2]
    return entry(
        outputs.separate,
        order_type(m), planes, planes, BYTES, plane, plane, plane, REAL, REAL, PIXELS, PIXELS,
    )  # fmt: skip


def measure_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the way from raw images to uncalibrated moments."""
    order, run = (0,) * m, measure_entry(m)
    ones = np.ones((m + 1, LEAST_PIXELS), np.complex64)

    def lane(images: Images, zeroth: str, *, spread: Spread = at_once) -> Any:
        pixels = images[0].size
        raw = np.ascontiguousarray(images).reshape(len(images), pixels)
        moments, saturated = empty((m + 1, pixels), np.complex64), empty(pixels, np.uint8)

        def part(start: int, stop: int) -> None:
            run(order, raw, ZEROTH[zeroth], ones, 0, 0.0, moments, saturated, start, stop)

        spread(part, pixels)
        return moments.reshape((m + 1, *images.shape[1:]))

    return lane


def smooth_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile smoothing; the lane gives None for
    moments that aren't finite, narrow images and other axes.
    """
    run = smooth_entry()

    def lane(moments: Complexes, taps: Reals, *, spread: Spread = at_once) -> Any:
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

    return lane


def separate_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the separation of direct and indirect light."""
    order, run = (0,) * m, separate_entry(m)

    def lane(weight: Reals, phase: Reals, threshold: float, *, spread: Spread = at_once) -> Any:
        shape, pixels = weight.shape[1:], weight[0].size
        angles = np.ascontiguousarray(phase).reshape(m, pixels)
        weights = np.ascontiguousarray(weight).reshape(m, pixels)
        flags = np.zeros(pixels, np.uint8)
        direct, indirect, first = (empty(pixels, np.float32) for _ in range(3))

        def part(start: int, stop: int) -> None:
            run(order, angles, weights, flags, direct, indirect, first, threshold, 1.0, start, stop)

        spread(part, pixels)
        return direct.reshape(shape), indirect.reshape(shape), first.reshape(shape)

    return lane
