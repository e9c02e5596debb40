"""The depth that libfreenect2's CPU processor computes, its filters off, stated anew.

From the description of its arithmetic (`src/cpu_depth_packet_processor.cpp` of
OpenKinect/libfreenect2 @ fd64c5d), so that it can be had of frames that libfreenect2 never saw.
`agreement` holds it to the outputs of libfreenect2 itself.
"""

import math
from typing import Final

import numpy as np

from tests.driver.cameras.kinect2.vectors import MULTIPLES, Array, Scene
from transientcam_driver.cameras.kinect2._parameters import LIGHT_X_M

SPEED_OF_LIGHT_M_S: Final = 3e8
"""It takes it for that, so that its depths are 0.069 % too long."""
_LEAST: Final = 3.0  # amplitude
_LEAST_SUM: Final = 10.0
_WIDEST, _NARROWEST = 0.611, 0.349  # rad


def path_m(moments: Array) -> Array:
    """Return the path (...) from the light to the camera by moments (3, ...); 0 where it is void.

    Phases are unwrapped one after the other: that of 80 MHz by 16 MHz, the half of the common
    period by 120 MHz, then that of 120 MHz. The path is that of the mean of the three, as one of
    72 MHz.
    """
    turns = np.mod(np.angle(moments) / (2 * np.pi), 1.0)
    # in units of c / (2 x 240 MHz), of which 80 MHz has 3, 16 MHz 15 and 120 MHz 2 a period
    slow, middle, fast = (period * each for period, each in zip((15, 3, 2), turns, strict=True))
    middle = middle + 3 * np.floor((slow - middle) / 3 + 0.5)
    odd = np.abs(middle - fast - 2 * np.rint((middle - fast) / 2)) > 0.5
    slow, middle = slow + 15 * odd, middle + 15 * odd
    fast = fast + 2 * np.floor((middle - fast) / 2 + 0.5)
    cycles = np.stack([slow / 15, middle / 3, fast / 2])
    amplitude = np.abs(moments)
    void = (amplitude < _LEAST).any(axis=0) | (amplitude.sum(axis=0) < _LEAST_SUM)
    void |= _apart_rad(cycles) > _tolerance_rad(amplitude.max(axis=0))
    found = cycles.sum(axis=0) / 3 * SPEED_OF_LIGHT_M_S / 72e6
    return np.where(void, 0.0, found)


def _apart_rad(cycles: Array) -> Array:
    """Return how far three phases are from the line that those of one path lie on."""
    line = np.array(MULTIPLES) / math.hypot(*MULTIPLES)
    along = np.tensordot(line, cycles, axes=1)
    across = (cycles**2).sum(axis=0) - along**2
    return np.asarray(2 * np.pi * np.sqrt(np.maximum(across, 0)))


def _tolerance_rad(amplitude: Array) -> Array:
    with np.errstate(divide="ignore"):
        allowed = np.exp(0.7694894 * 3.321928 - 0.5330578 * np.log(amplitude))
    return np.clip(allowed, _NARROWEST, _WIDEST)


def depth_mm(found_m: Array, x: Array, y: Array) -> Array:
    """Return z in mm by paths and slopes (x, y) of the rays: to first order in the offset."""
    length = np.sqrt(x * x + y * y + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = found_m / 2 / length / (1 - LIGHT_X_M * x / (found_m * length))
    return np.where(found_m > 0, 1e3 * z, 0.0)


def agreement(scene: Scene) -> tuple[float, float]:
    """Return the share of pixels as void as in its stored output, and the largest difference in mm.

    A few pixels of a border of decision may go the other way in single precision.
    """
    x, y = scene.slopes("bottom")
    void = scene.saturated.any(axis=0)
    found = depth_mm(np.where(void, 0.0, path_m(scene.moments)), x, y)
    stored = scene.stored["depth_mm_off"]
    same = (found > 0) == (stored > 0)
    both = (found > 0) & (stored > 0)
    return float(same.mean()), float(np.abs(found - stored)[both].max())
