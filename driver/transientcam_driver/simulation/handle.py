"""The simulated world as a program sees it: its truth, and its faults."""

from transientcam_driver.errors import CameraError
from transientcam_driver.sequence import Sequence
from transientcam_driver.simulation.device import EmulatedDevice
from transientcam_driver.simulation.explain import Explanation
from transientcam_driver.simulation.faults import Fault
from transientcam_driver.simulation.responses import Truth
from transientcam_driver.simulation.sensor import Sensor
from transientcam_driver.simulation.world import World


class Simulation:
    """What only a simulated camera offers.

    Attributes
    ----------
    scene
        Name of the scene.
    field_of_view_deg
        Horizontal, of the scene's camera; None where the scene says nothing of it.
    """

    def __init__(
        self,
        scene: str,
        world: World,
        device: EmulatedDevice,
        *,
        field_of_view_deg: float | None = None,
    ) -> None:
        self.scene = scene
        self.field_of_view_deg = field_of_view_deg
        self._world = world
        self._device = device

    def truth(self, *, device_time_s: float | None = None) -> Truth:
        """Ground truth of the scene at the exposure set: of the last image, or at a time."""
        return self._world.truth(device_time_s=device_time_s)

    def explain(self, sequence: Sequence | None = None) -> Explanation:
        """Say what each effect makes of the scene and a sequence, by default the one set."""
        return self._world.explain(self.scene, sequence)

    @property
    def sensor(self) -> Sensor:
        """Its sensor, as a data sheet would have it."""
        return self._world.sensor

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
