"""The emulated Kinect v2 without its cable: bytes of requests in, bytes of answers out.

What it checks is stricter than what is known of the device: a request that is malformed, unknown or
out of order stalls the endpoint.
"""

import struct
from collections import deque
from typing import Final

from transientcam_driver.cameras import kinect2
from transientcam_driver.errors import TransferStalled

FIRMWARE: Final = (2, 3, 3913, 7)
"""Major, minor, revision, build: invented in the manner of a real one."""
_HEADER: Final = struct.Struct("<5I")
_PARAMETERS: Final = (0, 1, 4)


class EmulatedFirmware:
    """Answers requests, and knows whether the light is on.

    ``parameters``, ``p0``: answers with the lens and the P0 tables.
    ``polls``: how often the status is asked for until the camera is ready.
    ``requests``: numbers of the commands so far, with their parameters.
    """

    def __init__(self, serial: str, parameters: bytes, p0: bytes, *, polls: int = 1) -> None:
        major, minor, revision, build = FIRMWARE
        version = struct.pack("<HHII4x", minor, major, revision, build)
        self._answers = {
            _key(kinect2.READ_FIRMWARE_VERSIONS): (bytes(48) + version).ljust(0x200, b"\0"),
            _key(kinect2.READ_HARDWARE): bytes(0x5C),
            _key(kinect2.READ_SERIAL): serial.encode("utf-16-le").ljust(0x80, b"\0"),
            _key(kinect2.READ_PARAMETERS): parameters,
            _key(kinect2.READ_P0): p0,
            _key(kinect2.READ_COLOR_PARAMETERS): b"\1".ljust(kinect2.COLOR_PARAMETERS_BYTES, b"\0"),
        }
        self._polls = polls
        self._polled = 0
        self._woken = False
        self._pending: deque[bytes] = deque()
        self._initialised = False
        self._streaming = False
        self.suspended = True
        self.requests: list[tuple[int, ...]] = []

    @property
    def lit(self) -> bool:
        """Whether the light is on: while images are captured."""
        return self._streaming and not self.suspended

    def write(self, data: bytes) -> None:
        """Take a request; an answer that was not read is dropped.

        Raises TransferStalled where it is none, or not possible now.
        """
        self._pending.clear()
        if len(data) < _HEADER.size or (len(data) - _HEADER.size) // 4 not in _PARAMETERS:
            raise TransferStalled
        magic, sequence, most_bytes, command, zero = _HEADER.unpack_from(data)
        if magic != kinect2.REQUEST_MAGIC or zero != 0:
            raise TransferStalled
        key = (command, *struct.unpack(f"<{len(data) // 4 - 5}I", data[_HEADER.size :]))
        self.requests.append(key)
        answer = self._answer(key)
        if answer:
            self._pending.append(answer[:most_bytes])
        self._pending.append(struct.pack("<2I8x", kinect2.COMPLETION_MAGIC, sequence))

    def read(self, most_bytes: int) -> bytes:
        """Return the next transfer of the answer endpoint.

        Raises TransferStalled where there is none, or it is longer than what is asked for.
        """
        if not self._pending or len(self._pending[0]) > most_bytes:
            raise TransferStalled
        return self._pending.popleft()

    def _answer(self, key: tuple[int, ...]) -> bytes:
        if key in self._answers:
            return self._answers[key]
        if key == _key(kinect2.READ_STATUS):
            self._polled += self._woken
            return int(self._polled >= self._polls).to_bytes(4, "little")
        if key in (_key(kinect2.MODE_ON), _key(kinect2.MODE_ON_PLAIN), _key(kinect2.MODE_OFF)):
            self._woken = True
        elif key == _key(kinect2.INITIALISE_STREAMS) and self._polled >= self._polls:
            self._initialised = True
        elif key == _key(kinect2.STREAMING_ON) and self._initialised and not self.suspended:
            self._streaming = True
        elif key in (_key(kinect2.STREAMING_OFF), _key(kinect2.STOP)):
            self._streaming = self._initialised = self._woken = False
            self._polled = 0
        else:
            raise TransferStalled
        return b""


def _key(request: kinect2.Request) -> tuple[int, ...]:
    return request.command, *request.parameters
