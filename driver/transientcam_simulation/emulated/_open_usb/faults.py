"""Faults of image packets on the cable."""

from collections import deque
from enum import StrEnum

from transientcam_driver.camera import IMAGE_HEADER_BYTES
from transientcam_driver.errors import CameraError


class Fault(StrEnum):
    """A fault of an image packet."""

    DROP = "drop"
    """It is lost."""
    CORRUPT_PIXELS = "corrupt-pixels"
    """Bits of its pixels flip; the header's checksum still holds."""
    CORRUPT_HEADER = "corrupt-header"
    """Bits of its header flip."""
    SHORTEN = "shorten"
    """The transfer ends in its middle."""
    DUPLICATE = "duplicate"
    """It comes twice."""
    SWAP = "swap"
    """The image behind it comes first."""
    BABBLE = "babble"
    """The device sends more than was asked for, and the transfer is lost."""


class PendingFaults:
    """Faults of the images to come, of the kinds that a camera can have.

    ``camera``: its name, for the error.
    """

    def __init__(self, camera: str, *kinds: Fault) -> None:
        self._camera = camera
        self._images = dict.fromkeys(kinds, 0)

    def inject(self, fault: Fault, images: int = 1) -> None:
        """Let a fault happen to so many more images.

        Raises CameraError where this camera knows no such fault.
        """
        if fault not in self._images:
            raise CameraError(f"the emulated {self._camera} knows no fault {fault!r}")
        self._images[fault] += images

    def take(self, fault: Fault) -> bool:
        """Return whether the fault happens to this image."""
        if not self._images[fault]:
            return False
        self._images[fault] -= 1
        return True


class FaultyCable:
    """Carries image packets as transfers, with the faults injected into the next ones.

    Faults happen in the order in which they were injected.
    """

    def __init__(self) -> None:
        self._pending: deque[Fault] = deque()
        self._held: bytes | None = None
        self._transfers: deque[bytes | None] = deque()

    def __bool__(self) -> bool:
        """Whether a transfer waits to be read."""
        return bool(self._transfers)

    def inject(self, fault: Fault, images: int) -> None:
        """Inject a fault into the next images that have none yet."""
        self._pending.extend([fault] * images)

    def clear(self) -> None:
        """Drop the packets on their way; faults that have not happened yet remain."""
        self._held = None
        self._transfers.clear()

    def take(self) -> bytes | None:
        """Return the next transfer, or None for one that overflows the host's buffer."""
        return self._transfers.popleft()

    def carry(self, packet: bytes) -> None:
        """Send an image packet, with its fault if it has one."""
        behind, self._held = self._held, None
        match self._pending.popleft() if self._pending else None:
            case None:
                self._transfers.append(packet)
            case Fault.DROP:
                pass
            case Fault.CORRUPT_PIXELS:
                self._transfers.append(_flipped(packet, (IMAGE_HEADER_BYTES + len(packet)) // 2))
            case Fault.CORRUPT_HEADER:
                self._transfers.append(_flipped(packet, IMAGE_HEADER_BYTES // 2))
            case Fault.SHORTEN:
                self._transfers.append(packet[: len(packet) // 2])
            case Fault.DUPLICATE:
                self._transfers.extend((packet, packet))
            case Fault.SWAP:
                self._held = packet
            case Fault.BABBLE:
                self._transfers.append(None)
        if behind is not None:
            self._transfers.append(behind)


def _flipped(packet: bytes, at: int) -> bytes:
    damaged = bytearray(packet)
    damaged[at] ^= 0x55
    return bytes(damaged)
