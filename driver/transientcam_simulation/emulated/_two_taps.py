"""What pixels with two taps measure: the differences of these, at any frequency."""

import copy
from collections import OrderedDict
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import FOUR_PHASES_RAD, ImageLabel, Sequence, SubPhases
from transientcam_simulation.imaging import SwitchableWorld, World
from transientcam_simulation.scene import Scene

ZERO_DN: Final = 2048
_ANY_HZ: Final = 7e6
_MOST_WORLDS: Final = 40  # m of 32, the zeroth moment, and what is changing

Images = NDArray[np.uint16]


class DifferentialPixels:
    """Pixels with two taps, which collect the light in phase and in opposite phase.

    A difference is ``2048 + (A - B) / 2``: a tap alone reads 1/2 (b_0 + Re(b exp(-i theta))), both
    together Re(b exp(-i theta)) / 2, without what they have in common.

    ``world``: the light in front of the sensor. What a scene needs for a frequency is kept for as
    long as the scene stays.
    ``saturated``: the code of a pixel of which a tap is full.
    ``phases_rad``: of the images of a frequency.
    """

    def __init__(
        self,
        world: SwitchableWorld,
        *,
        saturated: int,
        phases_rad: tuple[float, ...] = FOUR_PHASES_RAD,
    ) -> None:
        self._switchable = world
        self._saturated = saturated
        self._phases_rad = phases_rad
        self._of: World | None = None
        self._worlds: OrderedDict[Sequence, World] = OrderedDict()
        self._number = 0

    def expose_for(self, exposure_s: float) -> None:
        """Let the truth of the scene be that of images with this exposure."""
        sequence = _sequence(_ANY_HZ, exposure_s)
        self._switchable.configure(sequence, sequence.labels)

    def prepare(self, frequency_hz: float, exposure_s: float) -> None:
        """Compute what images at this frequency need."""
        self._world(frequency_hz, exposure_s)

    def temperature_c(self, device_time_s: float) -> float:
        """Temperature of the sensor."""
        return self._switchable.temperature_c(device_time_s)

    def differences(
        self, frequency_hz: float, exposure_s: float, *, delay_s: float, device_time_s: float
    ) -> Images:
        """Return the images (N, H, W) at the phases.

        ``delay_s`` is what the light takes inside of the camera.
        """
        world, sequence = self._world(frequency_hz, exposure_s)
        highest = world.sensor.highest_dn
        images = []
        for index, phase_rad in enumerate(self._phases_rad):
            late_rad = phase_rad - 2 * np.pi * frequency_hz * delay_s
            taps = [
                self._tap(world, sequence, index, late_rad + opposite, device_time_s)
                for opposite in (0.0, np.pi)
            ]
            difference = ZERO_DN + (taps[0].astype(np.int32) - taps[1]) / 2
            corrupt = (taps[0] >= highest) | (taps[1] >= highest)
            images.append(np.where(corrupt, self._saturated, np.rint(difference)).astype(np.uint16))
        return np.stack(images)

    def sum(self, exposure_s: float, *, device_time_s: float) -> Images:
        """Return the light (H, W) that both taps collect together, in DN."""
        world, sequence = self._world(_ANY_HZ, exposure_s)
        taps = [
            self._tap(world, sequence, 0, opposite, device_time_s).astype(np.int32)
            for opposite in (0.0, np.pi)
        ]
        dark_dn = 2 * world.sensor.dark_dn
        total: Images = np.clip(taps[0] + taps[1] - dark_dn, 0, 4095).astype(np.uint16)
        return total

    def _tap(
        self, world: World, sequence: Sequence, index: int, phase_rad: float, device_time_s: float
    ) -> Images:
        label = ImageLabel(index, 0, 1, sequence.base_frequency_hz, phase_rad, sequence.exposure_s)
        self._number += 1
        return world.image(label, number=self._number, device_time_s=device_time_s)

    def _world(self, frequency_hz: float, exposure_s: float) -> tuple[World, Sequence]:
        """Return the world that is prepared for a frequency."""
        base = self._switchable.world
        if base is not self._of:
            self._of = base
            self._worlds.clear()
        sequence = _sequence(frequency_hz, exposure_s)
        if sequence not in self._worlds:
            world = copy.copy(base)  # the same light; what is planned for a sequence is its own
            world.taps = 2
            world.configure(sequence, sequence.labels)
            world.prepare()
            self._worlds[sequence] = world
            if len(self._worlds) > _MOST_WORLDS:
                self._worlds.popitem(last=False)
        self._worlds.move_to_end(sequence)
        return self._worlds[sequence], sequence


def _sequence(frequency_hz: float, exposure_s: float) -> Sequence:
    return Sequence(
        base_frequency_hz=frequency_hz,
        harmonics=1,
        zeroth="estimated",
        exposure_s=exposure_s,
        sub_phases=SubPhases("none"),
    )


def with_bits(scene: Scene, bits: int) -> Scene:
    """Return a scene whose sensor has codes of so many bits over the same range of light."""
    finer = 2.0 ** (scene.sensor.bits - bits)
    sensor = replace(
        scene.sensor,
        bits=bits,
        gain_e_per_dn=scene.sensor.gain_e_per_dn * finer,
        dark_dn=scene.sensor.dark_dn / finer,
    )
    return replace(scene, sensor=sensor)
