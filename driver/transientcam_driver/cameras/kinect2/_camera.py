"""A Kinect v2 as a `Camera`: a stream that is on or off, and nothing else to choose."""

import threading
import time
import warnings
import weakref
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from transientcam_driver.camera import (
    AppliedSequence,
    CameraState,
    FactoryCalibration,
    HostCamera,
    RawFrame,
    Simulation,
    Status,
)
from transientcam_driver.cameras.kinect2._abilities import capabilities_of
from transientcam_driver.cameras.kinect2._device import Kinect2
from transientcam_driver.cameras.kinect2._frame_queue import Arrival, FrameQueue
from transientcam_driver.cameras.kinect2._frames import FrameMaker
from transientcam_driver.cameras.kinect2._off_switch import off_switch
from transientcam_driver.cameras.kinect2._parameters import DepthParameters, Rows
from transientcam_driver.cameras.kinect2._tables import P0Tables
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import (
    CameraError,
    CameraLost,
    FrameTimeout,
    NotStreaming,
)
from transientcam_driver.sequence import Sequence
from transientcam_supervisor import OffSwitch

SILENCE_S: Final = 2.0
UNREAD_S: Final = 2.0
READ_S: Final = 0.1
"""Longest wait for a frame in one go: how long a loss may stay unnoticed."""


class Kinect2Camera(HostCamera):
    """A `Camera` of a Kinect v2.

    It captures at 16, 80 and 120 MHz, three phases each, 30 times a second; ``takes`` is the one
    choice: so many of its frames make one. The camera has no watchdog of its own: while it is
    started and no frame is read for ``unread_s``, a thread here switches it off, and the next
    ``read_frame`` on again. That thread ends with this process; `off_switch` does not.

    ``connect``: opens the camera with a serial number, any where it is None.
    ``rows``: how the principal point is counted; see `parameters.ROWS`.
    ``clock``: of the times that frames carry; real time by default.
    ``simulation``: the handle on an emulated camera; None for a real one.
    ``silence_s``: without a whole frame for so long the camera is lost.
    ``unread_s``: without a reader for so long, or twice as long, the light goes off.
    ``now_s``: monotonic time, by which waits end.
    Raises CameraError as ``connect``, and `ProtocolError` where the camera's tables are none.
    """

    def __init__(
        self,
        connect: Callable[[str | None], Kinect2],
        *,
        rows: Rows = "top",
        clock: Clock | None = None,
        simulation: Simulation | None = None,
        silence_s: float = SILENCE_S,
        unread_s: float = UNREAD_S,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(clock or RealClock(), simulation)
        self._connect = connect
        self._silence_s = silence_s
        self._now_s = now_s
        self._frame_queue = FrameQueue(self.counters, self._clock)
        self._frames = FrameMaker(self._since_s)
        self._lit = False
        self._heard = 0, 0.0  # whole images, and when their count had last changed
        self._own(connect(None))
        try:
            identity = self._device.identity
            self._capabilities = capabilities_of(identity)
            self.factory = FactoryCalibration(
                P0Tables.unpack(identity.p0).gains(),
                DepthParameters.unpack(identity.parameters).lens(rows),
            )
            self._applied = self._capabilities.apply(
                self._capabilities.nearest(Sequence()), epoch=1
            )
        except BaseException:
            self._release.detach()
            self._device.close()
            raise
        self._state = CameraState.IDLE
        self._watch = Watch(unread_s, self._unread)

    # --- state -------------------------------------------------------------------------------

    @property
    def off_switch(self) -> OffSwitch:
        """Its commands, on an interface that is taken from this process."""
        return off_switch(self._device.node)

    def status(self) -> Status:
        """Return what is known here; a camera that does not stream is asked whether it is there."""
        with self._control:
            self._require_connected()
            if not self._lit:
                self._asked(self._device.check)
            return self._status(light_on=self._lit, temperature_c=None)

    # --- sequence and light ------------------------------------------------------------------

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set how many takes make a frame; those of the frame begun are dropped."""
        self.validate(sequence)
        with self._control:
            self._require_connected()
            epoch = self._applied.epoch + 1
            self._applied = self._capabilities.apply(sequence, epoch=epoch)
            self._frames.drop()
            return self._applied

    def start(self) -> None:
        """Switch the light on and capture frames back to back."""
        with self._control:
            self._require_connected()
            self._watch.note()
            self._light_on()
            self._resume = True

    def stop(self) -> None:
        """Switch the light off; a ``read_frame`` that is waiting raises NotStreaming."""
        with self._control:
            self._resume = False
            self._require_connected()
            self._state = CameraState.IDLE
            self._light_off()

    def reconnect(self) -> None:
        """After CameraLost: find the same camera again, restore the sequence, resume streaming."""
        with self._reading, self._control:
            self._require_open()
            if self._state is not CameraState.DISCONNECTED:
                return
            device = self._connect(self._capabilities.serial)
            self._release.detach()
            self._own(device)
            epoch = self._applied.epoch + 1
            self._applied = self._capabilities.apply(self._applied.sequence, epoch=epoch)
            self._state = CameraState.IDLE
            if self._resume:
                self._light_on()

    def close(self) -> None:
        """Switch the light off and give the camera back; may be called twice."""
        with self._control:
            if self._closed:
                return
            self._closed = True
            self._state = CameraState.DISCONNECTED
            self._frame_queue.end()
        self._watch.close()
        with self._reading, self._control:
            self._lit = False
            self._release.detach()
            self._device.close()

    # --- frames ------------------------------------------------------------------------------

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next complete frame.

        Raises FrameTimeout: none was complete in time; the camera goes on capturing. Raises
        NotStreaming where the camera was not started, or was stopped meanwhile. Raises CameraLost
        where it was unplugged, does not answer, or sends nothing whole; see ``reconnect``.
        """
        with self._reading:
            end_s = self._now_s() + timeout_s
            while True:
                self._keep_lit()
                left_s = end_s - self._now_s()
                arrival = self._take(max(0.0, min(left_s, READ_S)))
                if arrival is not None:
                    frame = self._collected(arrival)
                    if frame is not None:
                        return frame
                    continue
                self._check_silence()
                if left_s <= 0:
                    raise FrameTimeout(timeout_s)

    def _keep_lit(self) -> None:
        """Switch the light on again where nothing was read for too long."""
        with self._control:
            self._require_connected()
            if self._state is not CameraState.STREAMING:
                raise NotStreaming(self._state)
            self._watch.note()
            self._light_on()

    def _take(self, timeout_s: float) -> Arrival | None:
        try:
            return self._frame_queue.take(timeout_s)
        except CameraError as error:
            with self._control:
                self._require_open()  # closed by another thread: no loss
                self._lose()
            if isinstance(error, CameraLost):
                raise
            raise CameraLost(str(error)) from error

    def _collected(self, arrival: Arrival) -> RawFrame | None:
        """Add to the frame what arrived; return it once it has all takes."""
        with self._control:
            if self._state is not CameraState.STREAMING:  # stopped meanwhile
                return None
            frame = self._frames.push(arrival, self._applied)
            if frame is not None:
                self.counters.frames += 1
            return frame

    def _check_silence(self) -> None:
        """Give the camera up that sends nothing whole; where it does not answer, for that."""
        images, since_s = self._heard
        now_s, count = self._now_s(), self.counters.images
        if count != images:
            self._heard = count, now_s
            return
        if now_s - since_s < self._silence_s:
            return
        with self._control:
            self._require_connected()
            if not self._lit:
                return
            try:
                self._device.check()
            finally:
                self._lose()
        pieces = f"{self.counters.resyncs} pieces of images" if self.counters.resyncs else "nothing"
        raise CameraLost(
            f"no whole frame within {self._silence_s:g} s ({pieces} since it was opened)"
        )

    def _own(self, device: Kinect2) -> None:
        self._device = device
        self._release = weakref.finalize(self, _left_open, device)

    # --- under _control ----------------------------------------------------------------------

    def _light_on(self) -> None:
        if not self._lit:
            self._frame_queue.restart()
            self._frames.restart()
            self._heard = self.counters.images, self._now_s()
            self._asked(lambda: self._device.start(self._frame_queue.push, self._frame_queue.fail))
            self._lit = True
        self._state = CameraState.STREAMING

    def _light_off(self) -> None:
        self._frame_queue.end()
        self._asked(self._device.stop)
        self._lit = False

    def _unread(self) -> None:
        """Switch the light off without readers; the next `read_frame` needs it again."""
        with self._control:
            if self._lit:
                with suppress(CameraError):  # the next request fails in the same way
                    self._light_off()

    def _lose(self) -> None:
        """Mark the camera as gone, and switch off what still answers."""
        self._state = CameraState.DISCONNECTED
        self._frame_queue.end()
        self._device.close()
        self._lit = False

    def _asked(self, request: Callable[[], None]) -> None:
        """Send requests; a loss disconnects the camera."""
        try:
            request()
        except CameraLost:
            self._lose()
            raise


def _left_open(device: Kinect2) -> None:
    """Light off when the interpreter ends without close()."""
    warnings.warn("a camera was left open; use close() or `with`", ResourceWarning, stacklevel=2)
    device.close()


class Watch:
    """Calls a function where nothing was noted for a time.

    ``interval_s``: after one to two of these without a note.
    ``idle``: called on a thread of its own, again and again until something is noted.
    """

    def __init__(self, interval_s: float, idle: Callable[[], None]) -> None:
        self._interval_s = interval_s
        self._idle = idle
        self._notes = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="kinect2-watch", daemon=True)
        self._thread.start()

    def note(self) -> None:
        """Note that it still goes on."""
        self._notes += 1

    def close(self) -> None:
        """End the thread; the function is not called any more once this returns."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        notes = -1
        while not self._ended.wait(self._interval_s):
            if notes == self._notes:
                self._idle()
            notes = self._notes
