"""A frame whose reconstruction is known, by which each device is checked before it is used."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from transientcam_compiled import at_once
from transientcam_moments._dispatch import PLANAR
from transientcam_moments._kernels.one_pass import Constants
from transientcam_moments.arrays import Array
from transientcam_moments.images import calibrate, gaussian_taps, inverse_gains, measure, smooth
from transientcam_moments.likelihood import MODEL_ERROR, choice
from transientcam_moments.moment_problem import (
    bias,
    levinson,
    pisarenko,
    separate,
    smallest_eigenvalue,
)

SHAPE: Final = (24, 37)
_SIGMA_PX, _EPSILON, _FULL_SCALE, _THRESHOLD = 0.6, 4e-3, 4095.0, 0.1
_MOST_REDONE: Final = 0.25
_LIMITS: Final = {"smoothed": 5e-6, "validity": 5e-5, "brightness": 5e-5, "direct": 1e-2}
"""Largest errors, of the largest value; ten times those of devices that are right."""
_LIMIT_RAD: Final = 2e-3
_LIMIT_MEDIAN: Final = 1e-5
_NOISE_DN: Final = 25.0
_MOST_OTHERS: Final = 0.03
"""Share of numbers that rounding may change, as where it leads to another model."""


def wrong(m: int, make: Callable[[int, tuple[int, ...], Constants], Any]) -> str:
    """Say what a pass makes wrong of a known frame of an order; nothing where it is right.

    ``make``: returns the pass of a device.
    """
    images, gains = _images(m), _gains(m)
    settings = SimpleNamespace(
        zeroth="low-frequency", epsilon=_EPSILON, full_scale=_FULL_SCALE, threshold=_THRESHOLD,
        least_light=lambda dtype: 1.0,
    )  # fmt: skip
    inverse = inverse_gains(gains, (m + 1, *SHAPE))
    constants = Constants(settings, inverse, gaussian_taps(_SIGMA_PX), 1.0)
    found = make(m, SHAPE, constants).images(images, None, at_once)
    if found is None:
        return "it gave none"
    b = smooth(calibrate(measure(images.astype(float), zeroth="low-frequency"), gains), _SIGMA_PX)
    smallest = smallest_eigenvalue(b)
    biased = bias(b, _EPSILON, eigenvalue=smallest)
    returns = pisarenko(biased.moments)
    light = separate(returns, _THRESHOLD)
    known = {
        "smoothed": b,
        "validity": smallest / b[0].real,
        "brightness": biased.moments[0].real,
        "direct": light.direct,
    }
    for name, values in known.items():
        error = np.abs(getattr(found, name) - values).max() / np.abs(values).max()
        if not error <= _LIMITS[name]:
            return f"{name} is off by {error:.1e}"
    off = np.abs(np.angle(np.exp(1j * (found.range_m - light.phase_rad)))).max()
    if not off <= _LIMIT_RAD:
        return f"phases are off by {off:.1e} rad"
    if not np.array_equal(found.flags & 4, 4 * (images.max(axis=0) >= _FULL_SCALE)):
        return "saturated pixels are others"
    if found.redone > _MOST_REDONE * light.direct.size:
        return f"{found.redone} of {light.direct.size} pixels had to be done again"
    return ""


def wrong_kernel(name: str, m: int, compute: Callable[..., Any]) -> str:
    """Say what a device makes wrong of a known frame in the place of a kernel; as `wrong`.

    ``compute``: takes that kernel's arguments.
    """
    b = calibrate(measure(_images(m).astype(float), zeroth="low-frequency"), _gains(m))
    b = b.reshape(m + 1, -1).astype(np.complex64)
    c, phase = levinson(bias(b, _EPSILON).moments), np.linspace(-1, 6, 5)
    given: tuple[Any, ...] = (*c[1:], c.error, phase)
    if name == "likelihood":
        variance = np.full(b.shape, _NOISE_DN**2, np.float32)
        given = b, variance, choice.MOST_RETURNS, choice.TAIL_SHAPES, MODEL_ERROR, _THRESHOLD
    if (found := compute(*given)) is None:
        return "it gave none"
    wide = (x.astype(np.result_type(x, "d")) if isinstance(x, np.ndarray) else x for x in given)
    found, known = np.vstack(found), np.vstack(PLANAR[name](*wide))
    off = np.abs(found - known) / (np.abs(known) + 1e-3 * np.nanmax(np.abs(known)))
    off = np.where(np.isnan(found) & np.isnan(known), 0, np.nan_to_num(off, nan=1.0))
    median, most = np.quantile(off, (0.5, 1 - _MOST_OTHERS))
    right = median <= _LIMIT_MEDIAN and most <= _LIMIT_RAD
    return "" if right else f"{name} is off by {median:.1e}, at most {most:.1e}"


def _gains(m: int) -> Array:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    order = np.arange(m + 1)[:, None, None]
    return (1 + 0.01 * order + 0.001 * np.cos(y + x)) * np.exp(0.1j * order)


def _images(m: int) -> Array:
    """Return raw images (4 m + 4, H, W) of three returns that vary, with much noise."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] / max(SHAPE)
    order = np.arange(m + 1)[:, None, None]
    b = (900 + 500 * x) * np.exp(1j * order * (1 + 2 * x + y))
    b = b + (500 + 300 * y) * np.exp(1j * order * (3.4 + 2 * x))
    b = b + 200 * np.exp(1j * order * (5 + x * y))
    b[0] += 60
    b = b * _gains(m)
    step = np.exp(-0.5j * np.pi * np.arange(4))[:, None, None]
    images = np.concatenate([60 + (b[0].real + np.real(each * step)) / 2 for each in b])
    noise = np.random.default_rng(m).normal(0, _NOISE_DN, images.shape)
    images = np.clip(np.round(images + noise), 0, _FULL_SCALE).astype(np.uint16)
    images[5, 3, 4] = int(_FULL_SCALE)
    return images
