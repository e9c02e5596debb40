"""A world that can be exchanged for another while images are taken of it."""

import threading

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_simulation.imaging._world import World


class SwitchableWorld:
    """A renderer whose world can be exchanged at any time.

    ``world``: the one that images are taken of at present.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._configured: tuple[Sequence, tuple[ImageLabel, ...]] | None = None
        self._changing = threading.Lock()

    def change(self, world: World) -> None:
        """Exchange the world; returns once the new one is prepared.

        Images of the old one are taken until then. One frame may hold images of both.
        """
        while True:
            configured = self._configured
            if configured is not None:
                world.configure(*configured)
                world.prepare()  # may take seconds
            with self._changing:
                if configured == self._configured:  # else the sequence was changed meanwhile
                    self.world = world
                    return

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Set the sequence of the images."""
        with self._changing:
            self._configured = sequence, labels
            self.world.configure(sequence, labels)

    def prepare(self) -> None:
        """Compute what images of the sequence need; may take seconds."""
        self.world.prepare()

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Expose and read one image."""
        return self.world.image(label, number=number, device_time_s=device_time_s)

    def temperature_c(self, device_time_s: float) -> float:
        """Return that of the sensor."""
        return self.world.temperature_c(device_time_s)
