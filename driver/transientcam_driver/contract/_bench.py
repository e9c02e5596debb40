"""A camera on the bench, and what can be done to it there."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final

from transientcam_driver.camera import Camera, RawFrame, open_camera
from transientcam_driver.contract._expecting import ContractSkipped
from transientcam_driver.errors import SequenceError
from transientcam_driver.sequence import Sequence

QUICK: Final = Sequence(harmonics=1, zeroth="estimated", exposure_s=0.5e-3)
Fault = Callable[[Camera], None]


@dataclass(frozen=True, slots=True)
class Bench:
    """A camera to be put through the contract, and what can be done to it.

    Attributes
    ----------
    open
        Opens the camera.
    lit
        Reads whether the light is on, if possible not through the camera.
    unplug, replug, lose_image
        What happens to the camera; None where nothing can. A simulated camera's own by default.
    read_s
        How long a frame may take.
    """

    open: Callable[[], Camera]
    lit: Callable[[Camera], bool] | None = None
    unplug: Fault | None = None
    replug: Fault | None = None
    lose_image: Fault | None = None
    read_s: float = 30.0

    @classmethod
    def of(cls, spec: str) -> "Bench":
        """Put the camera of a name on the bench."""
        return cls(partial(open_camera, spec))

    def light_of(self, camera: Camera) -> bool:
        """Whether the light is on."""
        return camera.status().light_on if self.lit is None else self.lit(camera)

    def do(self, camera: Camera, fault: str) -> None:
        """Let something happen to the camera: unplug, replug or lose_image.

        Raises
        ------
        ContractSkipped
            It cannot be made to happen.
        """
        own: Fault | None = getattr(self, fault)
        if own is not None:
            own(camera)
        elif camera.simulation is not None:
            simulated = "drop_next" if fault == "lose_image" else fault
            getattr(camera.simulation, simulated)()
        else:
            raise ContractSkipped(f"nothing here can {fault.replace('_', ' ')}")

    def prepared(self) -> Camera:
        """Open the camera, and let it capture what is quick, if it can."""
        camera = self.open()
        with suppress(SequenceError):  # a recording has its own
            camera.configure(camera.capabilities.nearest(QUICK))
        return camera

    def read(self, camera: Camera) -> RawFrame:
        """Return the next frame."""
        return camera.read_frame(timeout_s=self.read_s)
