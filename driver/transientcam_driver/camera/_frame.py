"""A raw frame as a camera gives it, and what was received and lost."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import ImageLabel


@dataclass(frozen=True, slots=True)
class Hop:
    """What one relay adds to a frame.

    ``service_id``: which service relayed it.
    ``latency_s``: from its arrival at the service before to its arrival here, by the clocks of both
    machines.
    ``missed_frames``: frames that the service before had and this one never got, since this one was
    opened.
    """

    service_id: str
    latency_s: float
    missed_frames: int


@dataclass(frozen=True, slots=True)
class RawFrame:
    """All images of one transient image, as the camera measured them.

    Attributes
    ----------
    number
        Frame counter of the device; it never resets while the camera is plugged in.
    epoch
        Configuration it was captured with.
    images
        uint16 (N, H, W) in digital numbers (DN), in the order of ``labels``.
    device_time_s
        Begin of the first exposure on the device's clock.
    host_time_s
        Unix time at which the last image arrived.
    capture_s
        From the first exposure to the last read-out, by the device's clock.
    temperature_c
        Of the sensor, at the last image; None where the camera knows none.
    lost_images
        Images lost or corrupt between the frame delivered before and this one.
    hops
        The relays that it came through, the first one first; of a camera on this machine none.
    captured_unix_s
        Begin of the first exposure as `CaptureClock` has it; None until it is asked.
    """

    number: int
    epoch: int
    images: NDArray[np.uint16]
    labels: tuple[ImageLabel, ...]
    device_time_s: float
    host_time_s: float
    capture_s: float
    temperature_c: float | None
    lost_images: int
    hops: tuple[Hop, ...] = ()
    captured_unix_s: float | None = None

    @property
    def size_bytes(self) -> int:
        """What a frame takes in memory, but for a few hundred bytes."""
        return self.images.nbytes

    @property
    def by_take(self) -> NDArray[np.uint16]:
        """The images as (takes, images a take, H, W), in whichever order they were captured."""
        takes = self.labels[-1].take + 1
        each = len(self.labels) // takes
        shape = self.images.shape[1:]
        if takes > 1 and self.labels[1].take == 1:  # interleaved
            return self.images.reshape(each, takes, *shape).swapaxes(0, 1)
        return self.images.reshape(takes, each, *shape)

    def index_of(self, take: int, place: int) -> int:
        """Return the index in ``images`` of an image of a take, as `by_take` counts them."""
        own = (each.index for each in self.labels if each.take == take)
        return next(itertools.islice(own, place, None))


@dataclass(slots=True)
class Counters:
    """Images and frames received since the camera was opened."""

    images: int = 0
    lost: int = 0
    corrupt: int = 0
    duplicates: int = 0
    frames: int = 0
    incomplete_frames: int = 0
    resyncs: int = 0
