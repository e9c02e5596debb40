"""A `Camera` of a device that exposes on request."""

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final, TypeVar

from transientcam_driver.camera import (
    AppliedSequence,
    CameraState,
    FactoryCalibration,
    HostCamera,
    RawFrame,
    Simulation,
    Status,
)
from transientcam_driver.cameras.triggered._device import TriggeredDevice
from transientcam_driver.cameras.triggered._partial_frame import PartialFrame
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import (
    CameraError,
    CameraLost,
    CameraNotFound,
    FrameTimeout,
    ImagesLost,
    NotStreaming,
)
from transientcam_driver.sequence import Sequence
from transientcam_supervisor import OffSwitch

READ_S: Final = 0.1
"""Longest single wait: how long a stop may have to wait for a reader."""
_LOSSES: Final = 5
"""Losses in a row from which on the camera counts as lost, with the reason."""
_SHORTEST_S: Final = 1e-9  # where the clock does not move meanwhile
_T = TypeVar("_T")


class TriggeredCamera(HostCamera):
    """A `Camera` of a device that exposes on request.

    A frame with a lost image is dropped as a whole; the next one has their number. Where nothing
    else than losses comes, the camera is lost. Nothing is
    exposed, and so no light is on, unless ``read_frame`` is called.

    Parameters
    ----------
    connect
        Connects to the device, also after a loss. Raises a `CameraError`.
    clock
        Real time by default.
    simulation
        The handle on a simulated camera, whose lens is then known; None for a real one.
    on_close
        Called once the device was given back.

    Raises
    ------
    CameraError
        As ``connect``.
    """

    def __init__(
        self,
        connect: Callable[[], TriggeredDevice],
        *,
        clock: Clock | None = None,
        simulation: Simulation | None = None,
        on_close: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(clock or RealClock(), simulation)
        self._connect = connect
        self._on_close = on_close
        self._changed = threading.Condition(self._control)
        self._device = connect()
        self._capabilities = self._device.capabilities
        self._number = 0
        self._losses = 0
        self._lost = 0
        self._applied = self._capabilities.apply(self._capabilities.nearest(Sequence()))
        try:
            self._set(self._applied.sequence)
        except BaseException:
            self._device.close()
            raise
        width, height = self._capabilities.width, self._capabilities.height
        lens = None if simulation is None else simulation.lens(width=width, height=height)
        self.factory = None if lens is None else FactoryCalibration(lens=lens)
        self._state = CameraState.IDLE

    # --- state -------------------------------------------------------------------------------

    @property
    def off_switch(self) -> OffSwitch:
        """As the device states it."""
        return self._device.off_switch

    def status(self) -> Status:
        """Read the device's temperature, and put this camera's state beside it."""
        with self._control:
            self._require_connected()
            temperature_c = self._asked(self._device.temperature_c)
            streaming = self._state is CameraState.STREAMING
            return self._status(light_on=streaming, temperature_c=temperature_c)

    # --- sequence and light ------------------------------------------------------------------

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence; the frame that is being captured is dropped."""
        self.validate(sequence)
        with self._control:
            self._require_connected()
            self._asked(lambda: self._set(sequence))
            self._changed.notify_all()
            return self._applied

    def start(self) -> None:
        """Capture frames back to back, as long as they are read."""
        with self._control:
            self._require_connected()
            self._begin_frame()
            self._state = CameraState.STREAMING
            self._resume = True

    def stop(self) -> None:
        """Expose nothing more; a ``read_frame`` that is waiting raises NotStreaming."""
        with self._control:
            self._resume = False
            self._require_connected()
            self._state = CameraState.IDLE
            self._begin_frame()
            self._changed.notify_all()
            self._asked(self._device.light_off)

    def reconnect(self) -> None:
        """After CameraLost: connect again, restore the sequence, resume the capture."""
        with self._reading, self._control:
            self._require_open()
            if self._state is not CameraState.DISCONNECTED:
                return
            device = self._connect()
            try:
                found, known = device.capabilities.serial, self._capabilities.serial
                if found != known:
                    raise CameraNotFound(known)
                self._device, before = device, self._device
                before.close()
                self._capabilities = device.capabilities
                self._set(self._applied.sequence)
            except BaseException:
                device.close()
                raise
            self._state = CameraState.STREAMING if self._resume else CameraState.IDLE

    def close(self) -> None:
        """Expose nothing more and give the device back; may be called twice."""
        with self._control:
            if self._closed:
                return
            self._closed = True
            self._changed.notify_all()
            if self._state is not CameraState.DISCONNECTED:
                with suppress(CameraError):
                    self._device.light_off()
            self._state = CameraState.DISCONNECTED
        with self._reading:  # the device must not be closed while a thread reads
            self._device.close()
            self._on_close()

    # --- frames ------------------------------------------------------------------------------

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Capture the next complete frame; what a timeout interrupts goes on with the next call."""
        with self._reading:
            end_s = self._clock.now_s() + timeout_s
            while True:
                left_s = end_s - self._clock.now_s()
                partial = self._step(end_s)
                if partial is not None:
                    frame = self._receive(partial, min(left_s, READ_S))
                    if frame is not None:
                        return frame
                if left_s <= 0:
                    raise FrameTimeout(timeout_s)

    def _step(self, end_s: float) -> PartialFrame | None:
        """Do what is due next; return the frame that images are on their way for."""
        with self._control:
            self._require_connected()
            if self._state is not CameraState.STREAMING:
                raise NotStreaming(self._state)
            partial = self._partial
            if partial.settled_s is None:
                settles_s = self._asked(lambda: self._device.prepare(partial.next_group))
                partial.settled_s = self._clock.now_s() + settles_s
            now_s = self._clock.now_s()
            if now_s < partial.settled_s:
                wait_s = min(partial.settled_s, end_s) - now_s
                self._clock.wait(self._changed, max(0.0, wait_s))
                return None
            if not partial.exposing:
                if partial.begun_s is None:
                    partial.begun_s = now_s
                self._asked(lambda: self._device.trigger(partial.next_group))
                partial.exposing = True
            return partial

    def _receive(self, partial: PartialFrame, timeout_s: float) -> RawFrame | None:
        """Wait for images, and return the frame if they complete it."""
        try:
            images = self._device.receive(max(0.0, timeout_s))
        except ImagesLost as error:
            with self._control:
                if partial is self._partial:
                    self._drop(partial, error)
            return None
        except CameraLost:
            with self._control:
                self._require_open()  # closed by another thread: no loss
                self._state = CameraState.DISCONNECTED
            raise
        with self._control:
            if images is None or partial is not self._partial:  # stopped or set anew meanwhile
                return None
            self._losses = 0
            self.counters.images += len(images)
            partial.store(images)
            return self._delivered(partial) if partial.complete else None

    def _drop(self, partial: PartialFrame, error: ImagesLost) -> None:
        lost = len(partial.next_group)
        self.counters.lost += lost
        self.counters.incomplete_frames += 1
        self._lost += lost
        self._losses += 1
        self._number += 1
        self._begin_frame()
        if self._losses >= _LOSSES:
            self._losses = 0
            self._state = CameraState.DISCONNECTED
            raise CameraLost(f"{_LOSSES} times in a row {error}") from error

    def _delivered(self, partial: PartialFrame) -> RawFrame:
        assert partial.begun_s is not None  # noqa: S101  (it is complete)
        frame = RawFrame(
            number=self._number,
            epoch=partial.applied.epoch,
            images=partial.images,
            labels=partial.labels,
            device_time_s=partial.begun_s - self._since_s,
            host_time_s=self._clock.unix_s(),
            capture_s=max(self._clock.now_s() - partial.begun_s, _SHORTEST_S),
            temperature_c=self._asked(self._device.temperature_c),
            lost_images=self._lost,
        )
        self.counters.frames += 1
        self._lost = 0
        self._number += 1
        self._begin_frame()
        return frame

    # --- under _control ----------------------------------------------------------------------

    def _set(self, sequence: Sequence) -> None:
        applied = self._capabilities.apply(sequence, epoch=self._applied.epoch + 1)
        self._device.configure(applied)
        self._applied = applied
        self._begin_frame()

    def _begin_frame(self) -> None:
        """Drop what was captured of the present frame."""
        self._partial = PartialFrame(self._applied, self._capabilities)

    def _asked(self, request: Callable[[], _T]) -> _T:
        """Return the answer to a request; a loss disconnects the camera."""
        try:
            return request()
        except CameraLost:
            self._state = CameraState.DISCONNECTED
            raise
