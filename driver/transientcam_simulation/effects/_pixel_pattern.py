"""Pixel pattern: each pixel has its own delay and gain."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.errors import SceneError
from transientcam_simulation.base import Pattern
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightPlanes, PlaneEffect

_CODES = 4096  # of a turn, in files of phase offsets


class PixelPattern(PlaneEffect):
    """Delays and gains of the device, the same for every scene.

    Drawn from the seed of the device, not of the scene, so that a calibration is good for every
    scene.
    """

    name = "pixel-pattern"
    what = "each pixel has a delay and a gain of its own"
    figures = "pattern"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        pattern: Pattern = self._figures
        random = np.random.Generator(
            np.random.SFC64(np.random.SeedSequence((conditions.device.seed, 0x9A77)))
        )
        gain = 1 + pattern.gain * random.standard_normal(conditions.shape)
        self._gain = np.maximum(gain, 0).astype(np.float32)
        self._delay_s = delays_s(pattern, conditions.shape, random)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the device has a pattern."""
        pattern = conditions.device.pattern
        if pattern is None or not (pattern.delay_s or pattern.gain or pattern.file):
            return Call(False, "all pixels of the device are alike", 0.0, 0.0)
        delay_s = pattern.delay_s
        if pattern.file is not None:
            delay_s = float(np.std(read_offsets_rad(pattern.file)))
            delay_s /= 2 * np.pi * pattern.file_frequency_hz
        phase_rad = 2 * np.pi * conditions.highest_hz * delay_s
        # of normal phases, E|exp(i phase) - 1|^2 = 2 - 2 exp(-variance / 2)
        turned = 2 - 2 * np.exp(-0.5 * phase_rad**2)
        changes = conditions.of_light(float(np.sqrt(turned + pattern.gain**2)))
        reason = f"{delay_s * 1e12:.0f} ps and {pattern.gain:.1%} from pixel to pixel"
        return weigh(conditions, changes, reason)

    def on_light(self, planes: LightPlanes) -> None:
        """Turn and scale each pixel."""
        gain, delay_s = self._gain[planes.region], self._delay_s[planes.region]
        planes.constant = planes.constant * gain
        planes.mean *= gain
        for k, term in planes.terms.items():
            phase_rad = 2 * np.pi * k * planes.frequency_hz * delay_s
            term *= gain * np.exp(1j * phase_rad).astype(np.complex64)


def delays_s(
    pattern: Pattern, shape: tuple[int, int], random: np.random.Generator
) -> NDArray[np.float64]:
    """Each pixel's delay: measured, its mean removed and placed on the pixels; or drawn."""
    if pattern.file is None:
        return pattern.delay_s * random.standard_normal(shape)
    offsets_rad = read_offsets_rad(pattern.file)
    rows = (np.arange(shape[0]) * offsets_rad.shape[0]) // shape[0]
    columns = (np.arange(shape[1]) * offsets_rad.shape[1]) // shape[1]
    chosen: NDArray[np.float64] = offsets_rad[np.ix_(rows, columns)]
    return chosen / (2 * np.pi * pattern.file_frequency_hz)


def read_offsets_rad(path: Path) -> NDArray[np.float64]:
    """Read phase offsets (H, W) about their mean: int16 width, height, then codes of 1/4096 turn.

    Raises SceneError where the file cannot be read, or has other content.
    """
    try:
        words = np.frombuffer(path.read_bytes(), dtype="<i2")
    except (OSError, ValueError) as error:
        raise SceneError(path, "the file", str(error), "readable int16 numbers") from error
    if len(words) < 2 or words[0] <= 0 or words[1] <= 0:
        raise SceneError(path, "the file", len(words), "width, height and offsets as int16")
    width, height = int(words[0]), int(words[1])
    if len(words) != 2 + width * height:
        raise SceneError(path, "its length", len(words), f"2 + {width} x {height} numbers")
    offsets_rad = words[2:].reshape(height, width) * (2 * np.pi / _CODES)
    centred: NDArray[np.float64] = offsets_rad - np.median(offsets_rad)
    return centred
