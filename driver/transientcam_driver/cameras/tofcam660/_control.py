"""The connection for commands: one at a time, each with an answer or an error in time."""

import socket
import time
from collections.abc import Callable
from typing import Final

from transientcam_driver.cameras.tofcam660._wire import (
    HEAD_BYTES,
    TAIL_BYTES,
    Answer,
    Command,
    pack_request,
    payload_bytes,
    require_end,
)
from transientcam_driver.errors import CameraLost, CameraUnreachable, ProtocolError

_AT_ONCE_BYTES: Final = 4096


class ControlConnection:
    """Commands to one camera.

    Whatever comes in place of an answer, `exchange` ends within ``answer_s``, and closes the
    connection: behind a broken answer the next could not be separated from its rest.

    ``answer_s``: time for a connection, and for each answer.
    ``clock``: monotonic time in s.
    Raises CameraUnreachable: nothing answers at that address.
    """

    def __init__(
        self, host: str, port: int, *, answer_s: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._answer_s = answer_s
        self._clock = clock
        self._peer = f"{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=answer_s)
        except OSError as error:
            raise CameraUnreachable(self._peer) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    @property
    def addresses(self) -> tuple[str, str]:
        """Numeric addresses of this machine and of the camera, as they talk to each other."""
        return str(self._socket.getsockname()[0]), str(self._socket.getpeername()[0])

    def exchange(self, command: Command, data: bytes = b"") -> Answer:
        """Send a command and return its answer.

        Raises DeviceRefused where the camera does not do it; CameraLost where it does not answer in
        time, or not by the protocol.
        """
        try:
            payload = self._payload(pack_request(command, data))
        except (OSError, EOFError, ProtocolError) as error:
            self.close()
            late = isinstance(error, TimeoutError)
            reason = f"no answer within {self._answer_s:g} s" if late else str(error)
            raise CameraLost(f"{command.name} at {self._peer}: {reason}") from error
        return Answer.of(payload, command)

    def close(self) -> None:
        """Close the connection; never fails."""
        self._socket.close()

    def _payload(self, request: bytes) -> bytes:
        end_s = self._clock() + self._answer_s
        self._socket.settimeout(self._answer_s)
        self._socket.sendall(request)
        payload = self._take(payload_bytes(self._take(HEAD_BYTES, end_s)), end_s)
        require_end(self._take(TAIL_BYTES, end_s))
        return payload

    def _take(self, count: int, end_s: float) -> bytes:
        """Return so many bytes, however slowly they come, but not later."""
        taken = bytearray()
        while len(taken) < count:
            left_s = end_s - self._clock()
            if left_s <= 0:
                raise TimeoutError
            self._socket.settimeout(left_s)
            part = self._socket.recv(min(count - len(taken), _AT_ONCE_BYTES))
            if not part:
                raise EOFError("the camera closed the connection")
            taken += part
        return bytes(taken)
