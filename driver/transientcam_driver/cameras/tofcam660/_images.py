"""The connection for images: pieces over UDP, or a stream over TCP."""

import socket
import time
from collections.abc import Callable
from typing import Final, Protocol

from transientcam_driver.cameras.tofcam660._image import (
    LONGEST_PACKET_BYTES,
    PACKET_HEADER_BYTES,
    PacketHeader,
)
from transientcam_driver.errors import CameraError, CameraLost, ImagesLost

Clock = Callable[[], float]
_BUFFER_BYTES: Final = 2 * 1024 * 1024
_NEWER: Final = 1 << 15  # of the numbers of 16 bits, half is ahead and half behind
_STALE_READS: Final = 4096


class ImageConnection(Protocol):
    """Where images arrive."""

    def expect(self, image_bytes: int) -> None:
        """Forget what came before, and wait for an image of this length."""

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the image, or None if it takes longer.

        Raises ImagesLost where it will not come, or not whole; CameraLost where the connection was
        closed.
        """
        ...

    def close(self) -> None:
        """Close the connection; never fails."""


class UdpImages:
    """Images in pieces, which may be lost, doubled or out of order.

    ``camera``: the only address that packets are taken from.
    ``port``: where the camera sends them to; 0 takes any free port.
    ``image_s``: time for a whole image, from when it is expected.
    Raises CameraError: another program has the port.
    """

    def __init__(
        self, camera: str, port: int, *, image_s: float, clock: Clock = time.monotonic
    ) -> None:
        self._camera = camera
        self._image_s = image_s
        self._clock = clock
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            self._socket.bind(("", port))
        except OSError as error:
            self._socket.close()
            reason = f"UDP port {port} for its images cannot be had ({error.strerror})"
            raise CameraError(f"{reason}: end the program that has it, or use data=tcp") from error
        self.expect(0)

    @property
    def port(self) -> int:
        """Where images arrive."""
        return int(self._socket.getsockname()[1])

    def expect(self, image_bytes: int) -> None:
        """Forget what came before, and wait for an image of this length."""
        self._socket.setblocking(False)
        for _ in range(_STALE_READS):  # a flood must not keep it here
            try:
                self._socket.recv(LONGEST_PACKET_BYTES)
            except BlockingIOError:
                break
        self._measurement: int | None = None
        self._begin(image_bytes)
        self._end_s = self._clock() + self._image_s

    def receive(self, timeout_s: float) -> bytes | None:
        """Take packets until the image is whole, or the time is over."""
        end_s = min(self._clock() + timeout_s, self._end_s)
        while True:
            left_s = end_s - self._clock()
            self._socket.settimeout(max(left_s, 1e-6))
            try:
                packet, (sender, *_) = self._socket.recvfrom(LONGEST_PACKET_BYTES)
            except TimeoutError:
                packet, sender = b"", ""
            except OSError as error:
                raise CameraLost(f"images at {self._camera}: {error.strerror}") from error
            if sender == self._camera and self._whole_with(packet):
                return bytes(self._image)
            if left_s <= 0:
                if self._clock() < self._end_s:
                    return None
                missing = len(self._image) - self._got
                raise ImagesLost(
                    f"{missing} of {len(self._image)} bytes are missing after {self._image_s:g} s"
                )

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def _begin(self, image_bytes: int) -> None:
        self._image = bytearray(image_bytes)
        self._got = 0
        self._pieces: dict[int, int] = {}

    def _whole_with(self, packet: bytes) -> bool:
        """Take a packet that belongs to the image; return whether it is the last one missing."""
        if len(packet) < PACKET_HEADER_BYTES:
            return False
        header = PacketHeader.unpack(packet)
        data = memoryview(packet)[PACKET_HEADER_BYTES:]
        if not self._fits(header, len(data)):
            return False
        if header.measurement != self._measurement:
            older = self._measurement is not None and (
                (header.measurement - self._measurement) % (2 * _NEWER) >= _NEWER
            )
            if older:
                return False
            self._measurement = header.measurement
            self._begin(len(self._image))
        if header.offset in self._pieces:
            return False
        self._pieces[header.offset] = len(data)
        self._image[header.offset : header.offset + len(data)] = data
        self._got += len(data)
        return self._got == len(self._image) and self._seamless()

    def _fits(self, header: PacketHeader, length: int) -> bool:
        inside = 0 < length <= len(self._image) - header.offset
        return header.image_bytes == len(self._image) and header.bytes_here == length and inside

    def _seamless(self) -> bool:
        """Whether the pieces lie side by side; else some bytes came twice and others never."""
        at = 0
        while at in self._pieces:
            at += self._pieces[at]
        return at == len(self._image)


class TcpImages:
    """Images one behind the other on a connection; nothing says where one begins.

    ``image_s``: time for a whole image, from when it is expected; and for the connection.
    Raises CameraLost where the camera takes no connection.
    """

    def __init__(
        self, camera: str, port: int, *, image_s: float, clock: Clock = time.monotonic
    ) -> None:
        self._address = (camera, port)
        self._image_s = image_s
        self._clock = clock
        self._image = bytearray()
        self._got = 0
        self._socket = self._connected()

    def expect(self, image_bytes: int) -> None:
        """Wait for an image of this length; what came of another one is left with its connection.

        Raises CameraLost where the camera takes no new connection.
        """
        if self._got < len(self._image) or not self._silent():
            self._socket.close()
            self._socket = self._connected()
        self._image = bytearray(image_bytes)
        self._got = 0
        self._end_s = self._clock() + self._image_s

    def receive(self, timeout_s: float) -> bytes | None:
        """Take bytes until the image is whole, or the time is over."""
        end_s = min(self._clock() + timeout_s, self._end_s)
        room = memoryview(self._image)
        while self._got < len(self._image):
            left_s = end_s - self._clock()
            if left_s <= 0 and self._clock() >= self._end_s:
                missing = len(self._image) - self._got
                raise ImagesLost(f"{missing} of {len(self._image)} bytes are missing")
            self._socket.settimeout(max(left_s, 1e-6))
            try:
                count = self._socket.recv_into(room[self._got :])
            except TimeoutError:
                if self._clock() < self._end_s:
                    return None
                continue
            except OSError as error:
                raise CameraLost(f"images at {self._address[0]}: {error.strerror}") from error
            if not count:
                raise CameraLost(f"images at {self._address[0]}: the connection was closed")
            self._got += count
        return bytes(self._image)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _silent(self) -> bool:
        """Whether nothing waits that would be taken for the begin of an image."""
        self._socket.setblocking(False)
        try:
            self._socket.recv(1)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False

    def _connected(self) -> socket.socket:
        try:
            return socket.create_connection(self._address, timeout=self._image_s)
        except OSError as error:
            host, port = self._address
            raise CameraLost(f"images at {host}:{port}: {error.strerror or error}") from error
