"""The handle on a simulated camera, over its world and its device."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from transientcam_driver.camera import Explanation, Lens, Sensor, Truth
from transientcam_driver.errors import CameraError
from transientcam_driver.sequence import Sequence
from transientcam_simulation.base import giving_up_by
from transientcam_simulation.emulated._open_usb import Fault
from transientcam_simulation.imaging import SwitchableWorld, World
from transientcam_simulation.scene import Scene, parse_scene

PrepareScene = Callable[[Scene | str, Mapping[str, str], bool], tuple[Scene, World]]
"""Prepares a scene, given or by its name, with choices of effects, and with or without a diffuser
before the lens."""


class FaultyDevice(Protocol):
    """The emulated device behind the handle, whose cable can be pulled."""

    @property
    def plugged(self) -> bool:
        """Whether the cable is in."""
        ...

    def unplug(self) -> None:
        """Pull the cable."""
        ...

    def replug(self) -> None:
        """Plug the cable in again."""
        ...

    def inject(self, fault: Fault, images: int = 1) -> None:
        """Inject a fault into the next images."""
        ...


class SimulationHandle:
    """A `transientcam_driver.Simulation`: see there for what each member guarantees.

    ``scene``: the scene in front of the camera.
    ``world``, ``device``: the renderer of its images, and the device that sends them.
    ``prepare``: prepares another scene, or other effects.
    ``set_interlock``: closes or opens the safety interlock; None where the camera has none.
    ``taps``: of a pixel; of two, half of their difference is an image.
    """

    def __init__(
        self,
        scene: Scene,
        world: SwitchableWorld,
        device: FaultyDevice,
        *,
        prepare: PrepareScene,
        set_interlock: Callable[[bool], None] | None = None,
        taps: int = 1,
    ) -> None:
        self._taps = taps
        self._chosen: Scene | str = scene  # without choices of effects
        self._definition: str | None = None
        self._scene = scene
        self._world = world
        self._device = device
        self._prepare = prepare
        self._set_interlock = set_interlock
        self._effects: dict[str, str] = {}
        self._diffuser = False
        self._changing = threading.Lock()

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self._scene.name

    @property
    def definition(self) -> str | None:
        """Text of the scene's file, where `change` was given it."""
        return self._definition

    def lens(self, *, width: int, height: int) -> Lens | None:
        """Return what images are taken through, and where their light is; None without a place."""
        camera, light = self._scene.camera, self._scene.light
        if camera is None:
            return None
        seen = replace(camera, lens=self._world.world.lens)
        lens = seen.as_lens(light.position_m, width=width, height=height)
        if self._diffuser:  # which the light goes through
            return lens
        axis = camera.axes @ (light.aim_at_m - light.position_m)
        axis = (axis / np.linalg.norm(axis)).tolist()
        white_dn = float(light.electrons_per_s / self._world.world.sensor.gain_e_per_dn)
        return replace(lens, beam=(*axis, float(light.beam_exponent), white_dn))

    @property
    def effects(self) -> dict[str, str]:
        """Choices that `change` made in place of the scene's."""
        return dict(self._effects)

    @property
    def diffuser(self) -> bool:
        """Whether filter and diffuser are before the lens."""
        return self._diffuser

    def change(
        self,
        *,
        scene: str | None = None,
        definition: str | None = None,
        effects: Mapping[str, str] | None = None,
        diffuser: bool | None = None,
        ask: Callable[[], object] = lambda: None,
    ) -> None:
        """Prepare another scene, other effects or the diffuser, and switch to it."""
        with self._changing, giving_up_by(ask):
            wanted: Scene | str = self._chosen
            if definition is not None:
                wanted = parse_scene(definition)
            elif scene is not None and scene != self.scene:
                wanted = scene
            else:
                definition = self._definition
            chosen = self.effects if effects is None else dict(effects)
            before_lens = self._diffuser if diffuser is None else diffuser
            found, world = self._prepare(wanted, chosen, before_lens)
            self._world.change(world)
            self._chosen, self._definition, self._scene = wanted, definition, found
            self._effects, self._diffuser = chosen, before_lens

    def truth(self, *, device_time_s: float | None = None) -> Truth:
        """Ground truth of the last image, or at a time."""
        return self._world.world.truth(device_time_s=device_time_s)

    def explain(self, sequence: Sequence | None = None) -> Explanation:
        """Explain what each effect makes of a sequence, by default the one set."""
        return self._world.world.explain(self.scene, sequence)

    @property
    def sensor(self) -> Sensor:
        """The sensor of the scene it was built with, or one of one tap that has its noise."""
        sensor = self._world.world.sensor
        return replace(
            sensor,
            gain_e_per_dn=self._taps * sensor.gain_e_per_dn,
            read_noise_e=self._taps**0.5 * sensor.read_noise_e,
        )

    @property
    def plugged(self) -> bool:
        """Whether the cable is in."""
        return self._device.plugged

    def unplug(self) -> None:
        """Pull the cable."""
        self._device.unplug()

    def replug(self) -> None:
        """Plug the cable in again."""
        self._device.replug()

    def corrupt_next(self, images: int = 1) -> None:
        """Damage the pixels of the next images on the wire."""
        self._device.inject(Fault.CORRUPT_PIXELS, _count(images))

    def drop_next(self, images: int = 1) -> None:
        """Lose the next images on the wire."""
        self._device.inject(Fault.DROP, _count(images))

    def set_interlock(self, *, closed: bool) -> None:
        """Open or close the safety interlock of the light."""
        if self._set_interlock is None:
            raise CameraError("this camera has no interlock")
        self._set_interlock(closed)


def _count(images: int) -> int:
    if images < 1:
        raise CameraError(f"images = {images}: must be at least 1")
    return images
