"""What a device has to do, so that `TriggeredCamera` makes a camera of it."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import AppliedSequence, Capabilities
from transientcam_driver.sequence import ImageLabel
from transientcam_supervisor import OffSwitch

Images = NDArray[np.uint16]
Group = tuple[ImageLabel, ...]
"""The images of one frequency and take: what the device exposes in one go."""


class TriggeredDevice(Protocol):
    """A device that is connected, its light off.

    Calls come from one thread at a time, but for ``receive``, which may run beside the others.
    Each raises `CameraLost` where the device does not answer, and another `CameraError` where it
    refuses.
    """

    @property
    def capabilities(self) -> Capabilities:
        """Limits and size of the device."""
        ...

    @property
    def off_switch(self) -> OffSwitch:
        """How another process ends an exposure; ``OffSwitch()`` where none can."""
        ...

    def configure(self, applied: AppliedSequence) -> None:
        """Prepare for a sequence."""

    def prepare(self, labels: Group) -> float:
        """Set what the next images need, and return how long that takes to settle, in s."""
        ...

    def trigger(self, labels: Group) -> None:
        """Expose these images once; images of earlier triggers are of no more use."""

    def receive(self, timeout_s: float) -> Images | None:
        """Return the images (N, H, W) of the last trigger, or None if they take longer.

        Raises
        ------
        ImagesLost
            They will not come, or not whole.
        """
        ...

    def temperature_c(self) -> float:
        """Temperature of the sensor."""
        ...

    def light_off(self) -> None:
        """End an exposure that goes on, if there is one."""

    def close(self) -> None:
        """Give the device back, its light off; never fails."""
