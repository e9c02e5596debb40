"""Assemble the images of one transient image, and count what is missing."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.capabilities import AppliedSequence, Capabilities
from transientcam_driver.protocol import ImageHeader
from transientcam_driver.protocol.units import phase_word
from transientcam_driver.receiving.decoder import ImagePacket
from transientcam_driver.receiving.hop import Hop
from transientcam_driver.sequence import ImageLabel


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
        Of the sensor, at the last image.
    lost_images
        Images lost or corrupt between the frame delivered before and this one.
    hops
        The relays that it came through, the first one first; of a camera on this machine none.
    """

    number: int
    epoch: int
    images: NDArray[np.uint16]
    labels: tuple[ImageLabel, ...]
    device_time_s: float
    host_time_s: float
    capture_s: float
    temperature_c: float
    lost_images: int
    hops: tuple[Hop, ...] = ()

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


class FrameAssembler:
    """Collect image packets of one epoch into frames.

    A frame with a missing or corrupt image is dropped as a whole; the next complete one has the
    number of images lost. Packets of another epoch belong to a sequence that was replaced, and
    are left out.
    """

    def __init__(
        self, applied: AppliedSequence, capabilities: Capabilities, counters: Counters
    ) -> None:
        self.epoch = applied.epoch
        self._labels = applied.labels
        self._shape = (len(self._labels), capabilities.height, capabilities.width)
        self._phases = [phase_word(label.phase_rad) for label in self._labels]
        self._words = [capabilities.tuning_word(label.frequency_hz) for label in self._labels]
        self._period_s = applied.sequence.exposure_s + capabilities.streaming_readout_s
        self._counters = counters
        self._lost_since_delivery = 0
        self.restart(0)

    def restart(self, first_image: int) -> None:
        """Begin a new run, of which ``first_image`` is the first sequence number."""
        self._next_number = first_image
        self._images: NDArray[np.uint16] | None = None
        self._frame = -1
        self._received = 0
        self._first_time_s = 0.0

    def push(self, packet: ImagePacket, *, host_time_s: float) -> RawFrame | None:
        """Take an image; return the frame it completes, if any."""
        header = packet.header
        if header.epoch != self.epoch:  # usb-protocol 10.10
            return None
        if not self._in_order(header):  # usb-protocol 10.9
            self._counters.duplicates += 1
            return None
        if not packet.intact or not self._as_labelled(header):  # usb-protocol 10.8, 10.10
            self._counters.corrupt += 1
            self._lost_since_delivery += 1
            self._abandon()
            return None
        self._counters.images += 1
        if header.index == 0:
            self._begin(header)
        # usb-protocol 8.3, 10.8: an image of this frame is missing
        elif self._images is None or header.frame != self._frame or header.index != self._received:
            self._abandon()
            return None
        assert self._images is not None  # noqa: S101  (begun above, or checked)
        pixels = np.frombuffer(packet.payload, dtype="<u2").reshape(self._shape[1:])
        self._images[header.index] = pixels
        self._received += 1
        return self._finish(header, host_time_s) if self._received == len(self._labels) else None

    def _in_order(self, header: ImageHeader) -> bool:
        """Count the images missing before this one; false for a number that came before.

        A gap in the sequence numbers is the number of images lost (usb-protocol 8.3).
        """
        gap = header.number - self._next_number
        if gap < 0:
            return False
        self._counters.lost += gap
        self._lost_since_delivery += gap
        self._next_number = header.number + 1
        return True

    def _as_labelled(self, header: ImageHeader) -> bool:
        """Whether the header is that of the sequence's image at its index (usb-protocol 5.3)."""
        k = header.index
        return (
            header.count == len(self._labels)
            and k < len(self._labels)
            and header.tuning_word == self._words[k]
            and header.phase == self._phases[k]
            and header.harmonic == self._labels[k].harmonic
        )

    def _begin(self, header: ImageHeader) -> None:
        self._abandon()
        self._images = np.empty(self._shape, np.uint16)
        self._frame = header.frame
        self._first_time_s = header.device_time_ns / 1e9

    def _abandon(self) -> None:
        if self._images is not None:
            self._counters.incomplete_frames += 1
        self._images = None
        self._received = 0

    def _finish(self, header: ImageHeader, host_time_s: float) -> RawFrame:
        assert self._images is not None  # noqa: S101  (the caller has just filled it)
        frame = RawFrame(
            number=header.frame,
            epoch=self.epoch,
            images=self._images,
            labels=self._labels,
            device_time_s=self._first_time_s,
            host_time_s=host_time_s,
            capture_s=header.device_time_ns / 1e9 - self._first_time_s + self._period_s,
            temperature_c=header.temperature_c,
            lost_images=self._lost_since_delivery,
        )
        self._images = None
        self._received = 0
        self._lost_since_delivery = 0
        self._counters.frames += 1
        return frame
