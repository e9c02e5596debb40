"""What the driver of a Kinect v2 requires of its cable: what libusb and an emulation both do."""

from collections.abc import Callable
from typing import Final, Protocol

from transientcam_driver.errors import CameraError

VENDOR_ID: Final = 0x045E
PRODUCT_IDS: Final = (0x02D8, 0x02C4)
"""Of the model that was sold, and of the preview for developers; libfreenect2's udev rules."""

PacketTaker = Callable[[bytes], None]
"""Takes one isochronous packet; an empty one where nothing or nothing whole came."""
FailureTaker = Callable[[CameraError], None]
"""Takes the reason why no packet will come any more."""


class Link(Protocol):
    """An opened device: bulk transfers of commands, a few control requests, a stream of packets.

    Each method but ``close`` raises `CameraLost` where the device does not answer within a second.
    """

    node: str
    """Device node of usbfs; empty without one."""

    def write(self, data: bytes) -> None:
        """Send a request to the command endpoint."""

    def read(self, most_bytes: int) -> bytes:
        """Return the next transfer of the answer endpoint."""
        ...

    def set_suspended(self, suspended: bool) -> None:
        """Suspend the function of the depth camera, or wake it up (SET_FEATURE, USB 3.2, 9.4.9)."""

    def set_stream_enabled(self, enabled: bool) -> None:
        """Give the depth endpoint its bandwidth, or take it away: alternate setting 1 or 0."""

    def start_images(self, received: PacketTaker, failed: FailureTaker) -> None:
        """Hand over every packet from now on, in their order, on a thread of the link.

        Both functions must return at once, and must not call the link.
        """

    def stop_images(self) -> None:
        """Hand over nothing more once this returns; no effect where nothing is handed over.

        It must not be called by a function that ``start_images`` was given.
        """

    def close(self) -> None:
        """Give the device back; never fails, and may be called twice."""
