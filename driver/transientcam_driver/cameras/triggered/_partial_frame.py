"""A frame of which some images are still missing."""

from itertools import groupby

import numpy as np

from transientcam_driver.camera import AppliedSequence, Capabilities
from transientcam_driver.cameras.triggered._device import Group, Images
from transientcam_driver.sequence import ImageLabel


class PartialFrame:
    """Collects the images of one frame, group by group.

    ``settled_s``: when the device is ready for the next group; None before it was prepared.
    ``exposing``: whether images of the next group were asked for.
    ``begun_s``: when the first ones were asked for.
    """

    def __init__(self, applied: AppliedSequence, capabilities: Capabilities) -> None:
        self.applied = applied
        self.labels = applied.labels
        self.images = np.empty(
            (len(self.labels), capabilities.height, capabilities.width), np.uint16
        )
        self._left = [tuple(group) for _, group in groupby(self.labels, _of_group)]
        self.settled_s: float | None = None
        self.exposing = False
        self.begun_s: float | None = None

    @property
    def next_group(self) -> Group:
        """The images that are captured next."""
        return self._left[0]

    @property
    def complete(self) -> bool:
        """Whether all images are there."""
        return not self._left

    def store(self, images: Images) -> None:
        """Take the images of the next group."""
        self.images[[label.index for label in self._left[0]]] = images
        self._left.pop(0)
        self.settled_s, self.exposing = None, False


def _of_group(label: ImageLabel) -> tuple[int, int]:
    return label.take, label.harmonic
