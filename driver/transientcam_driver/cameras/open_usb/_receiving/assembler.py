"""Assemble the images of one transient image, and count what is missing."""

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import AppliedSequence, Capabilities, Counters, RawFrame
from transientcam_driver.cameras.open_usb._receiving.decoder import ImagePacket
from transientcam_driver.cameras.open_usb.protocol import ImageHeader, phase_word


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
        self._lost_since_delivery = 0
        self._counters.frames += 1
        return frame
