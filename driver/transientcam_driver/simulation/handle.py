"""The simulated world as a program sees it: its truth, and its faults."""

import threading
from collections.abc import Callable, Mapping

from transientcam_driver.errors import CameraError
from transientcam_driver.sequence import Sequence
from transientcam_driver.simulation.device.faults import Fault
from transientcam_driver.simulation.device.usb_device import EmulatedDevice
from transientcam_driver.simulation.explain import Explanation
from transientcam_driver.simulation.responses import Truth
from transientcam_driver.simulation.scene.scene import Scene
from transientcam_driver.simulation.sensor import Sensor
from transientcam_driver.simulation.world import Outlook, World

Staging = Callable[[str, Mapping[str, str]], tuple[Scene, World]]
"""Prepares a scene by its name, with choices of effects."""


class Simulation:
    """What only a simulated camera offers."""

    def __init__(
        self, scene: Scene, outlook: Outlook, device: EmulatedDevice, *, staged: Staging
    ) -> None:
        self._scene = scene
        self._outlook = outlook
        self._device = device
        self._staged = staged
        self._effects: dict[str, str] = {}
        self._changing = threading.Lock()

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self._scene.name

    @property
    def field_of_view_deg(self) -> float | None:
        """Horizontal, of the scene's camera; None where the scene says nothing of it."""
        return None if self._scene.camera is None else self._scene.camera.field_of_view_deg

    @property
    def effects(self) -> dict[str, str]:
        """Choices of effects, "auto", "on" or "off", that `change` made in place of the scene's."""
        return dict(self._effects)

    def change(self, *, scene: str | None = None, effects: Mapping[str, str] | None = None) -> None:
        """Put the camera in front of another scene, or choose other effects; images go on.

        Returns once the scene is prepared, which may take seconds. The camera stays the same
        specimen: its sensor and its imperfections are those of the scene it was built with. The
        frame that is captured meanwhile may hold images of both.

        Parameters
        ----------
        scene
            Name of a built-in scene, a path to a scene's .toml, or the scene it was built with;
            the present one by default.
        effects
            "auto", "on" or "off" by an effect's name, in place of all earlier choices; by default
            these stay.

        Raises
        ------
        SceneError
            There is no such scene, or it says something that cannot be.
        EffectError
            There is no such effect or choice.
        """
        with self._changing:
            chosen = self.effects if effects is None else dict(effects)
            found, world = self._staged(self.scene if scene is None else scene, chosen)
            self._outlook.change(world)
            self._scene, self._effects = found, chosen

    def truth(self, *, device_time_s: float | None = None) -> Truth:
        """Ground truth of the scene at the exposure set: of the last image, or at a time."""
        return self._outlook.world.truth(device_time_s=device_time_s)

    def explain(self, sequence: Sequence | None = None) -> Explanation:
        """Say what each effect makes of the scene and a sequence, by default the one set."""
        return self._outlook.world.explain(self.scene, sequence)

    @property
    def sensor(self) -> Sensor:
        """Its sensor, as a data sheet would have it."""
        return self._outlook.world.sensor

    @property
    def plugged(self) -> bool:
        """Whether the cable is in."""
        return self._device.plugged

    def unplug(self) -> None:
        """Pull the cable; the camera raises CameraLost."""
        self._device.unplug()

    def replug(self) -> None:
        """Plug the cable in again; ``Camera.reconnect`` finds the camera."""
        self._device.replug()

    def corrupt_next(self, images: int = 1) -> None:
        """Damage the pixels of the next images on the wire."""
        self._device.expect(Fault.CORRUPT_PIXELS, _count(images))

    def drop_next(self, images: int = 1) -> None:
        """Lose the next images on the wire."""
        self._device.expect(Fault.DROP, _count(images))

    def set_interlock(self, *, closed: bool) -> None:
        """Open or close the safety interlock of the light."""
        self._device.set_interlock(closed=closed)


def _count(images: int) -> int:
    if images < 1:
        raise CameraError(f"images = {images}: must be at least 1")
    return images
