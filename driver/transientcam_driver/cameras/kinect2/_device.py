"""A Kinect v2 that is connected: what it is, and how its stream is started and stopped.

The order of requests is that of OpenKinect/libfreenect2 @ fd64c5d (``src/libfreenect2.cpp``,
``Freenect2DeviceImpl::startStreams``, ``stop`` and ``close``), the one public program that is known
to work with the camera. What a request without an answer is for is not known for all of them, so
that none is left out.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from transientcam_driver.cameras.kinect2 import _commands as commands
from transientcam_driver.cameras.kinect2._commands import Request
from transientcam_driver.cameras.kinect2._link import FailureTaker, Link, PacketTaker
from transientcam_driver.errors import (
    CameraError,
    CameraLost,
    CameraNotFound,
    DeviceRefused,
    ProtocolError,
    TransferStalled,
)

READY_TRIES: Final = 50
READY_EVERY_S: Final = 0.1
_log = logging.getLogger("transientcam_driver.kinect2.device")

Action = Request | Callable[[Link], None]


@dataclass(frozen=True, slots=True)
class Identity:
    """What a camera says of itself."""

    firmware: str
    serial: str
    parameters: bytes
    """Answer with the parameters of the depth camera, 92 bytes or more."""
    p0: bytes
    """Answer with the P0 tables, 1 302 572 bytes or more."""


_STOP: Final[tuple[Action, ...]] = (
    lambda link: link.stop_images(),
    lambda link: link.set_stream_enabled(False),
    commands.MODE_ON,
    commands.MODE_OFF,
    commands.STOP,
    commands.STREAMING_OFF,
    commands.MODE_ON_PLAIN,
    commands.MODE_OFF,
    commands.MODE_ON_PLAIN,
    commands.MODE_OFF,
    lambda link: link.set_suspended(True),
)
STOP_REQUESTS: Final = tuple(each for each in _STOP if isinstance(each, Request))
"""What is requested of the camera itself to switch its light off, in this order."""
_CLOSE: Final[tuple[Action, ...]] = (commands.MODE_ON, commands.MODE_OFF)


class Kinect2:
    """One camera, its light off until `start`.

    Not for several threads at a time. Whatever fails, the rest of what switches the light off is
    tried all the same.

    ``link``: owned from now on.
    ``pause``: sleeps for so many seconds.
    ``serial``: the camera that it has to be; None for any.
    Raises CameraNotFound where it is another camera. Raises CameraError where it does not answer,
    or not by the protocol; the link is closed.
    """

    def __init__(
        self, link: Link, *, pause: Callable[[float], None], serial: str | None = None
    ) -> None:
        self._link = link
        self._pause = pause
        self._sequence = 0
        self._closed = False
        try:
            self.identity = self._identify()
            if serial is not None and serial != self.identity.serial:
                raise CameraNotFound(serial)
            self.stop()  # also where its last owner left the light on
        except BaseException:
            self.close()
            raise

    @property
    def node(self) -> str:
        """Device node of usbfs; empty without one."""
        return self._link.node

    def start(self, received: PacketTaker, failed: FailureTaker) -> None:
        """Switch the light on and hand over packets, as `Link.start_images` does.

        Raises CameraError where the light is off.
        """
        try:
            found = self._identify()
            if found.serial != self.identity.serial:
                raise CameraLost(f"it is now the one with serial number {found.serial!r}")
            self._do(commands.MODE_ON)
            self._do(commands.MODE_OFF)
            self._wait_until_ready()
            self._do(commands.INITIALISE_STREAMS)
            self._link.set_stream_enabled(True)
            self._do(commands.READ_STATUS)
            self._do(commands.STREAMING_ON)
            self._link.start_images(received, failed)
        except BaseException:
            self._attempt(_STOP)
            raise

    def stop(self) -> None:
        """Switch the light off, and hand over nothing more.

        Raises CameraError: one of the requests failed; all were tried.
        """
        failure = self._attempt(_STOP)
        if failure is not None:
            raise failure

    def check(self) -> None:
        """Ask for the status. Raises CameraError where it does not answer."""
        self._do(commands.READ_STATUS)

    def close(self) -> None:
        """Switch the light off and give the camera back; never fails, and may be called twice."""
        if not self._closed:
            self._closed = True
            self._attempt((*_STOP, *_CLOSE))
            self._link.close()

    # --- requests ----------------------------------------------------------------------------

    def _identify(self) -> Identity:
        self._link.set_suspended(False)
        firmware = commands.firmware_version(self._do(commands.READ_FIRMWARE_VERSIONS))
        self._do(commands.READ_HARDWARE)
        serial = commands.serial_number(self._do(commands.READ_SERIAL))
        parameters = self._do(commands.READ_PARAMETERS)
        p0 = self._do(commands.READ_P0)
        self._do(commands.READ_COLOR_PARAMETERS)
        return Identity(firmware, serial, parameters, p0)

    def _wait_until_ready(self) -> None:
        for _ in range(READY_TRIES):
            if commands.is_ready(self._do(commands.READ_STATUS)):
                return
            self._pause(READY_EVERY_S)
        raise CameraError(f"the camera is not ready within {READY_TRIES * READY_EVERY_S:g} s")

    def _attempt(self, actions: tuple[Action, ...]) -> CameraError | None:
        """Try all of these, and return the first failure."""
        failure: CameraError | None = None
        for action in actions:
            try:
                if isinstance(action, Request):
                    self._do(action)
                else:
                    action(self._link)
            except CameraError as error:
                failure = failure or error
        return failure

    def _do(self, request: Request) -> bytes:
        """Send a request, and return its answer; empty for a request without one."""
        sequence, self._sequence = self._sequence, (self._sequence + 1) % (1 << 32)
        try:
            self._link.write(request.pack(sequence))
            answer = self._link.read(request.most_bytes) if request.most_bytes else b""
            if commands.is_completion(answer):
                raise ProtocolError(f"{request.name} was completed without an answer")
            completion = self._link.read(commands.COMPLETION_BYTES)
        except TransferStalled as error:
            raise DeviceRefused(request.name, "STALL", "it stalled the transfer") from error
        completed = commands.completed_sequence(completion, request)
        if completed != sequence:
            # libfreenect2 goes on, too: whether all firmwares count alike is not known
            _log.warning("%s: completion of %d, not of %d", request.name, completed, sequence)
        return commands.checked_answer(answer, request)
