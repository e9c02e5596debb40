"""What the simulated camera looks at, which may be changed while it takes images."""

import threading

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_driver.simulation.world import World


class Outlook:
    """A renderer in front of whose sensor one world can take the place of another.

    Attributes
    ----------
    world
        The one that images are taken of.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._asked: tuple[Sequence, tuple[ImageLabel, ...]] | None = None
        self._changing = threading.Lock()

    def change(self, world: World) -> None:
        """Let images from now on be of ``world``; returns once it is prepared.

        Images of the old one are taken until then. One frame may hold images of both.
        """
        while True:
            asked = self._asked
            if asked is not None:
                world.configure(*asked)  # may take seconds
            with self._changing:
                if asked == self._asked:  # else it was prepared for a sequence of the past
                    self.world = world
                    return

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Prepare for the images of a sequence."""
        with self._changing:
            self._asked = sequence, labels
            self.world.configure(sequence, labels)

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Expose and read one image."""
        return self.world.image(label, number=number, device_time_s=device_time_s)

    def temperature_c(self, device_time_s: float) -> float:
        """Return that of the sensor."""
        return self.world.temperature_c(device_time_s)
