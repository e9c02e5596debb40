"""From packets of the isochronous endpoint to the sub-images of a frame.

A sub-image ends with a footer of 152 bytes, and usually with a packet of length zero behind it
(`src/depth_packet_stream_parser.cpp` of OpenKinect/libfreenect2). A packet that was lost or torn
costs the sub-image it belongs to; the next footer or zero-length packet begins anew.
"""

import struct
from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2._layout import MEASURED, SUB_IMAGE_BYTES, SUB_IMAGES

FOOTER_BYTES: Final = 152
TICK_S: Final = 0.125e-3
"""Of the timestamps (`include/libfreenect2/frame_listener.hpp`)."""
_TOTAL: Final = SUB_IMAGE_BYTES + FOOTER_BYTES
_ALL: Final = (1 << MEASURED) - 1
_NUMBERS: Final = 1 << 32
_LONGEST_GAP: Final = 300
"""Frames; a larger step of the sequence is a stream that began anew."""
# two of unknown meaning, timestamp, sequence, number of the sub-image, length; unknown ones follow
_FOOTER: Final = struct.Struct("<6I")


class Footer(NamedTuple):
    """What stands behind a sub-image; ``timestamp`` counts ticks of 0.125 ms."""

    magic: tuple[int, int]
    timestamp: int
    sequence: int
    number: int

    @classmethod
    def of_tail(cls, data: bytearray) -> Self | None:
        """Read the footer that data ends with; None where it ends with none."""
        if len(data) < FOOTER_BYTES:
            return None
        first, second, *known, length = _FOOTER.unpack_from(data, len(data) - FOOTER_BYTES)
        footer = cls((first, second), *known)
        return footer if length == SUB_IMAGE_BYTES and footer.number < SUB_IMAGES else None

    def pack(self) -> bytes:
        """Return the bytes of the footer; what is of unknown meaning is 0."""
        known = self.timestamp, self.sequence, self.number, SUB_IMAGE_BYTES
        return _FOOTER.pack(*self.magic, *known).ljust(FOOTER_BYTES, b"\0")


@dataclass(frozen=True, slots=True, eq=False)
class SubImages:
    """The nine measured sub-images of a frame."""

    sequence: int
    """Number of the frame, by the device."""
    timestamp: int
    """Of the sub-image that came first, in ticks of `TICK_S`."""
    data: NDArray[np.uint8]
    """uint8 (9, `SUB_IMAGE_BYTES`), in the order of their numbers."""
    lost: int
    """Measured sub-images that are missing since the frame before."""


class Assembler:
    """Collects packets into frames; never raises, whatever the bytes.

    A frame is returned with the last of its nine measured sub-images, without waiting for the
    tenth or for the next frame.

    ``torn``: stretches of bytes that were no whole sub-image.
    ``lost``: measured sub-images that are missing in all, those of frames without any among them.
    ``incomplete_frames``: frames that were begun and dropped.
    """

    def __init__(self) -> None:
        self.torn = 0
        self.lost = 0
        self.incomplete_frames = 0
        self._buffer = bytearray()
        self._overflown = False
        self._lost_before = 0
        self.reset()

    def reset(self) -> None:
        """Drop what was collected, as of a stream that was stopped; the counters stay."""
        self._buffer.clear()
        self._overflown = False
        self._sequence: int | None = None
        self._timestamp = 0
        self._seen = 0
        self._data = np.empty((MEASURED, SUB_IMAGE_BYTES), np.uint8)

    def push(self, packet: bytes | memoryview) -> SubImages | None:
        """Take the next packet, which is copied; return the frame it completes, if any."""
        if not packet:  # the end of a sub-image
            self._begin_sub_image(torn=bool(self._buffer))
            return None
        self._buffer += packet
        if len(self._buffer) > _TOTAL:
            self.torn += not self._overflown
            self._overflown = True
            del self._buffer[:-FOOTER_BYTES]  # the end may still be a footer
        footer = Footer.of_tail(self._buffer)
        if footer is None:
            if len(self._buffer) == _TOTAL:
                self._begin_sub_image(torn=True)
            return None
        whole = len(self._buffer) == _TOTAL and not self._overflown
        found = self._take(footer) if whole else None
        self._begin_sub_image(torn=not whole)
        return found

    def _begin_sub_image(self, *, torn: bool) -> None:
        self.torn += torn and not self._overflown  # which is counted already
        self._buffer.clear()
        self._overflown = False

    def _take(self, footer: Footer) -> SubImages | None:
        """Store the whole sub-image in the buffer."""
        if footer.sequence != self._sequence:
            self._begin_frame(footer)
        if footer.number >= MEASURED or self._seen == _ALL:
            return None
        self._data[footer.number] = np.frombuffer(self._buffer, np.uint8, SUB_IMAGE_BYTES)
        self._seen |= 1 << footer.number
        if self._seen != _ALL:
            return None
        lost = self.lost - self._lost_before
        found = SubImages(footer.sequence, self._timestamp, self._data, lost)
        self._lost_before = self.lost
        self._data = np.empty_like(self._data)
        return found

    def _begin_frame(self, footer: Footer) -> None:
        if self._sequence is not None:
            missing = MEASURED - self._seen.bit_count()
            self.incomplete_frames += missing > 0
            skipped = (footer.sequence - self._sequence - 1) % _NUMBERS
            between = skipped if skipped <= _LONGEST_GAP else 0
            self.lost += missing + MEASURED * between
        self._sequence, self._timestamp = footer.sequence, footer.timestamp
        self._seen = 0
