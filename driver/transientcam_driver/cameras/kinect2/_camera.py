"""A Kinect v2 as a `Camera`: a stream that is on or off, and nothing else to choose."""

from collections.abc import Callable
from typing import Any

from transientcam_driver.camera import AppliedSequence, FactoryCalibration, RawFrame
from transientcam_driver.cameras.kinect2._abilities import capabilities_of
from transientcam_driver.cameras.kinect2._commands import COMPLETION_BYTES
from transientcam_driver.cameras.kinect2._device import (
    READY_EVERY_S,
    READY_TRIES,
    STOP_REQUESTS,
    Kinect2,
)
from transientcam_driver.cameras.kinect2._frame_queue import Arrival, FrameQueue
from transientcam_driver.cameras.kinect2._frames import FrameMaker
from transientcam_driver.cameras.kinect2._parameters import DepthParameters, Rows
from transientcam_driver.cameras.kinect2._tables import P0Tables
from transientcam_driver.cameras.kinect2._usb_link import (
    ANSWERS,
    COMMANDS,
    CONTROL,
    FUNCTION_SUSPEND,
    SET_FEATURE,
    STREAM,
    SUSPEND_AND_WAKE,
    TO_INTERFACE,
)
from transientcam_driver.cameras.streamed import StreamedCamera
from transientcam_driver.errors import CameraError, CameraLost
from transientcam_supervisor import (
    OffSwitch,
    Step,
    UsbClaim,
    UsbControl,
    UsbRead,
    UsbSetting,
    UsbWrite,
)


class Kinect2Camera(StreamedCamera[Kinect2, Arrival]):
    """A `Camera` of a Kinect v2; arguments and errors as of `StreamedCamera`.

    It captures at 16, 80 and 120 MHz, three phases each, 30 times a second; ``takes`` is the one
    choice: so many of its frames make one. The camera has no watchdog of its own.

    ``rows``: how the principal point is counted; see `parameters.ROWS`.
    Raises also `ProtocolError` where the camera's tables are none.
    """

    def __init__(
        self, connect: Callable[[str | None], Kinect2], *, rows: Rows = "top", **others: Any
    ) -> None:
        self._rows: Rows = rows
        super().__init__(connect, **others)

    def _describe(self) -> None:
        identity = self._device.identity
        self._frame_queue = FrameQueue(self.counters, self._clock)
        self._frames = FrameMaker(self._since_s)
        self._capabilities = capabilities_of(identity)
        self.factory = FactoryCalibration(
            P0Tables.unpack(identity.p0).gains(),
            DepthParameters.unpack(identity.parameters).lens(self._rows),
        )

    @property
    def off_switch(self) -> OffSwitch:
        """Its commands, on an interface that is taken from this process."""
        return off_switch(self._device.node)

    def _begin(self) -> None:
        self._frame_queue.restart()
        self._frames.restart()
        self._device.start(self._frame_queue.push, self._frame_queue.fail)

    def _end(self) -> None:
        self._release_reader()
        self._device.stop()

    def _release_reader(self) -> None:
        self._frame_queue.end()

    def _take(self, timeout_s: float) -> Arrival | None:
        try:
            return self._frame_queue.take(timeout_s)
        except CameraError as error:
            raise error if isinstance(error, CameraLost) else CameraLost(str(error)) from error

    def _collected(self, arrival: Arrival) -> RawFrame | None:
        return self._frames.push(arrival, self._applied)

    def _set(self, applied: AppliedSequence) -> None:
        self._frames.drop()
        super()._set(applied)

    def _check(self) -> None:
        self._device.check()

    def _temperature_c(self) -> None:
        if (
            not self._lit
        ):  # no request for one is known, and one that streams shows that it is there
            self._check()

    def _silence(self) -> str:
        torn = self.counters.resyncs
        return f"{torn} pieces of images since it was opened" if torn else super()._silence()


def off_switch(node: str) -> OffSwitch:
    """Return it for the camera at a device node.

    Commands go over an endpoint, whose interface has to be taken from the owner. Whether a reset of
    the port switches the light off is not known, so that none is asked for.
    """
    commands: list[Step] = []
    for number, request in enumerate(STOP_REQUESTS):
        commands += UsbWrite(COMMANDS, request.pack(number)), UsbRead(ANSWERS, COMPLETION_BYTES)
    steps = (
        UsbClaim(CONTROL),
        UsbClaim(STREAM),
        UsbSetting(STREAM, 0),
        *commands,
        UsbControl(TO_INTERFACE, SET_FEATURE, FUNCTION_SUSPEND, SUSPEND_AND_WAKE),
    )
    return OffSwitch(node, steps, start_s=READY_TRIES * READY_EVERY_S)
