"""What the pixels of an emulated Kinect v2 measure: differences of two taps, with their noise."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2 import (
    BASE_FREQUENCY_HZ,
    EXPOSURE_S,
    HEIGHT,
    IN_ORDER,
    MEASURED,
    PHASES,
    SAMPLING,
    WIDTH,
    codes,
    encoder,
)
from transientcam_driver.sequence import Sequence, SubPhases
from transientcam_simulation.effects import ReadNoise, ShotNoise
from transientcam_simulation.imaging import SwitchableWorld

_SEQUENCE: Final = Sequence(
    base_frequency_hz=BASE_FREQUENCY_HZ,
    harmonics=len(SAMPLING.multiples),
    zeroth="estimated",
    exposure_s=EXPOSURE_S,
    sub_phases=SubPhases("none"),
    sampling=SAMPLING,
)


class DifferencePixels:
    """Pixels of two taps in opposite phase, whose difference is what the camera sends.

    A difference is g Re(b exp(-i theta)) with the gain g exp(-i P0) of its frequency; its noise is
    that of a pixel of `Sensor` with half of the light b_0, whatever g is. What a real one has
    is not known. It is saturated where a tap is full.

    ``gains``: of `P0Tables.gains`.
    ``seed``: of the noise.
    """

    def __init__(self, world: SwitchableWorld, gains: NDArray[np.complex64], *, seed: int) -> None:
        self._world = world
        self._gains = gains
        self._seed = seed
        self._labels = _SEQUENCE.labels
        phases_rad = np.array(SAMPLING.phases_rad)
        # an image is 1/2 (b_0 + Re(b exp(-i theta)))
        self._weights = (4 / PHASES * np.exp(1j * phases_rad)).astype(np.complex64)
        world.configure(_SEQUENCE, self._labels)
        world.prepare()

    def sub_images(self, number: int, *, device_time_s: float) -> NDArray[np.uint8]:
        """Return the sub-images (9, bytes) of a frame."""
        mean_e = np.empty((MEASURED, HEIGHT, WIDTH), np.float32)
        for image, label in zip(mean_e, self._labels, strict=True):
            time_s = device_time_s + label.index * 2 * EXPOSURE_S
            image[:] = self._world.world.mean_image_e(
                label, number=MEASURED * number + label.index, device_time_s=time_s
            )
        return codes.sub_images(self._samples(mean_e, number))

    def _samples(self, mean_e: NDArray[np.float32], number: int) -> NDArray[np.float32]:
        """Return what the pixels send (9, H, W), in the order of the stream; NaN is saturated."""
        sensor = self._world.world.sensor
        by_frequency = mean_e.reshape((-1, PHASES, HEIGHT, WIDTH))
        half_e = by_frequency.mean(axis=1)
        moments = np.einsum("p,fpyx->fyx", self._weights, by_frequency) / sensor.gain_e_per_dn
        samples = encoder.samples(moments, self._gains).astype(np.float32)
        fuller_e = np.maximum(mean_e, 2 * half_e.repeat(PHASES, axis=0) - mean_e)
        in_stream = np.empty_like(mean_e)
        in_stream[list(IN_ORDER)] = fuller_e
        samples += self._noise(half_e, number)
        samples[in_stream > sensor.full_well_e] = np.nan
        return samples

    def _noise(self, half_e: NDArray[np.float32], number: int) -> NDArray[np.float32] | float:
        world = self._world.world
        shot, read = (world.choice(effect) != "off" for effect in (ShotNoise, ReadNoise))
        if not (shot or read):
            return 0.0
        read_e = world.sensor.read_noise_e if read else 0.0
        variance_e2 = (half_e if shot else 0 * half_e) + np.float32(read_e**2)
        deviation = np.sqrt(variance_e2) / np.float32(world.sensor.gain_e_per_dn)
        random = np.random.Generator(np.random.SFC64(np.random.SeedSequence((self._seed, number))))
        noise = random.standard_normal((len(half_e), PHASES, HEIGHT, WIDTH), np.float32)
        noise *= deviation[:, None]
        in_stream = np.empty((MEASURED, HEIGHT, WIDTH), np.float32)
        in_stream[list(IN_ORDER)] = noise.reshape(in_stream.shape)
        return in_stream
