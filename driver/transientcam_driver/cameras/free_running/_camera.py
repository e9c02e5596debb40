"""A `Camera` of a device that captures by itself."""

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Final, Protocol, TypeVar

import numpy as np

from transientcam_driver.camera import (
    AppliedSequence,
    CameraState,
    Capabilities,
    FactoryCalibration,
    HostCamera,
    RawFrame,
    Status,
)
from transientcam_driver.cameras.free_running._frequencies import common_base
from transientcam_driver.cameras.free_running._measurement import Capture, Description
from transientcam_driver.cameras.free_running._rendering import BITS, Renderer
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import (
    CameraError,
    CameraLost,
    CameraNotFound,
    FrameTimeout,
    NotStreaming,
)
from transientcam_driver.sequence import Sampling, Sequence
from transientcam_supervisor import OffSwitch

RECEIVE_S: Final = 0.1
"""How long a device is waited for in one go, and so a stop."""
SILENCE_S: Final = 5.0
_MOST_TAKES: Final = 16
_T = TypeVar("_T")


class FreeRunningDevice(Protocol):
    """A device that is connected, its light off.

    Calls come from one thread at a time, but for ``receive``, which may run beside
    ``temperature_c`` and ``light_off``. Each raises `CameraLost` where the device does not answer, and another
    `CameraError` where it refuses.
    """

    @property
    def description(self) -> Description:
        """What it is and measures; constant."""
        ...

    @property
    def off_switch(self) -> OffSwitch:
        """How another process switches the light off; ``OffSwitch()`` where none can."""
        ...

    def start(self, exposure_s: float) -> None:
        """Switch the light on and capture, with this exposure where it can be set."""
        ...

    def receive(self, timeout_s: float) -> Capture | None:
        """Return the next whole frame since the start, or None if it takes longer."""
        ...

    def temperature_c(self) -> float | None:
        """Ask for the temperature, by which the device also shows that it is there."""
        ...

    def light_off(self) -> None:
        """Stop, and switch the light off; also where it was not started."""
        ...

    def close(self) -> None:
        """Give the device back, its light off; never fails."""
        ...


class FreeRunningCamera(HostCamera):
    """A `Camera` of a device that captures by itself; ``takes`` of its frames make one here.

    A thread takes each frame once it comes. Where none reads them the newest is kept: the next
    frame says how many were lost, here and in the device, by its own numbers. Frames have the times
    of the device.

    Parameters
    ----------
    connect
        Connects to the device, also after a loss. Raises a `CameraError`.
    clock
        Real time by default.
    on_close
        Called once the device was given back.
    silence_s
        Without a frame for so long the camera counts as lost.

    Raises
    ------
    CameraError
        As ``connect``; `ProtocolError` where the description is not possible.
    """

    def __init__(
        self,
        connect: Callable[[], FreeRunningDevice],
        *,
        clock: Clock | None = None,
        on_close: Callable[[], None] = lambda: None,
        silence_s: float = SILENCE_S,
    ) -> None:
        super().__init__(clock or RealClock(), None)
        self._connect, self._on_close, self._silence_s = connect, on_close, silence_s
        self._arrived = threading.Condition()
        self._kept: Capture | CameraError | None = None
        self._receiving: tuple[threading.Thread, threading.Event] | None = None
        self._takes: list[Capture] = []
        self._expected: int | None = None  # the device's number of the next frame
        self._number = self._lost = 0
        self._device_s, self._heard_s = 0.0, self._since_s
        self._device = connect()
        try:
            about = self._device.description
            self._renderer = Renderer(about)
            self._capabilities = capabilities_of(about, self._renderer)
            self._applied = self._capabilities.apply(
                self._capabilities.nearest(Sequence()), epoch=1
            )
        except BaseException:
            self._device.close()
            raise
        self.factory = FactoryCalibration(self._renderer.gains, about.lens, self._renderer.sensor)
        self._state = CameraState.IDLE

    # --- state -------------------------------------------------------------------------------

    @property
    def off_switch(self) -> OffSwitch:
        """As the device states it."""
        return self._device.off_switch

    def device_time_s(self) -> float:
        """Time of the device's last frame, and what has passed since it came."""
        return self._device_s + self._clock.now_s() - self._heard_s

    def status(self) -> Status:
        """Read the device's temperature, and put this camera's state beside it."""
        with self._control:
            self._require_connected()
            temperature_c = self._asked(self._device.temperature_c)
            streaming = self._state is CameraState.STREAMING
            return self._status(light_on=streaming, temperature_c=temperature_c)

    # --- sequence and light ------------------------------------------------------------------

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence; frames of the one before are dropped."""
        self.validate(sequence)
        with self._control:
            self._require_connected()
            before = self._applied.sequence.exposure_s
            self._apply(sequence)
            if self._receiving and self._applied.sequence.exposure_s != before:
                self._end()
                self._begin()
            return self._applied

    def start(self) -> None:
        """Switch the light on and capture frames back to back."""
        with self._control:
            self._require_connected()
            self._state = CameraState.STREAMING
            self._resume = True
            if self._receiving is None:
                self._begin()

    def stop(self) -> None:
        """Switch the light off; a ``read_frame`` that is waiting raises NotStreaming."""
        with self._control:
            self._resume = False
            self._require_connected()
            self._state = CameraState.IDLE
            self._end()

    def reconnect(self) -> None:
        """After CameraLost: connect again, restore the sequence, resume the capture."""
        with self._reading, self._control:
            self._require_open()
            if self._state is not CameraState.DISCONNECTED:
                return
            device = self._connect()
            found, known = device.description.serial, self._capabilities.serial
            if found != known:
                device.close()
                raise CameraNotFound(known)
            self._device.close()
            self._device = device
            self._apply(self._applied.sequence)
            self._state = CameraState.IDLE
            if self._resume:
                self._begin()
                self._state = CameraState.STREAMING

    def close(self) -> None:
        """Switch the light off and give the device back; may be called twice."""
        with self._control:
            if self._closed:
                return
            self._closed = True
            if self._state is not CameraState.DISCONNECTED:
                with suppress(CameraError):
                    self._end()
            self._state = CameraState.DISCONNECTED
        with self._reading:
            self._device.close()
            self._on_close()

    # --- frames ------------------------------------------------------------------------------

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the newest complete frame; takes that have come are kept over a timeout."""
        with self._reading:
            end_s = self._clock.now_s() + timeout_s
            while True:
                left_s = end_s - self._clock.now_s()
                with self._arrived:
                    if self._kept is None and self._state is CameraState.STREAMING:
                        self._arrived.wait(max(0.0, min(left_s, RECEIVE_S)))
                    found, self._kept = self._kept, None
                frame = self._taken(found)
                if frame is not None:
                    return frame
                if left_s <= 0:
                    raise FrameTimeout(timeout_s)

    def _taken(self, found: Capture | CameraError | None) -> RawFrame | None:
        """Add what has come to the frame; return it once all takes are there."""
        with self._control:
            self._require_connected()
            if self._state is not CameraState.STREAMING:
                raise NotStreaming(self._state)
            silent_s = self._clock.now_s() - self._heard_s
            if found is None and silent_s > self._silence_s:
                found = CameraLost(f"no frame within {self._silence_s:g} s")
            if isinstance(found, CameraError):
                self._lose()
                raise found
            return None if found is None else self._collected(found)

    def _collected(self, capture: Capture) -> RawFrame | None:
        applied = self._applied
        each = applied.images // applied.sequence.takes
        missing = 0 if self._expected is None else max(0, capture.number - self._expected)
        self._expected = capture.number + 1
        self.counters.images += each
        self.counters.lost += missing * each
        self._lost += missing * each
        self._number += missing
        self._takes.append(capture)
        if len(self._takes) < applied.sequence.takes:
            return None
        takes, self._takes = self._takes, []
        made = [self._renderer.images(one) for one in takes]
        period_s = 1 / self._device.description.frame_rate_hz
        last_s = period_s if capture.capture_s is None else capture.capture_s
        frame = RawFrame(
            number=self._number,
            epoch=applied.epoch,
            images=np.concatenate(made) if len(made) > 1 else made[0],
            labels=applied.labels,
            device_time_s=takes[0].device_time_s,
            host_time_s=self._clock.unix_s(),
            capture_s=capture.device_time_s - takes[0].device_time_s + last_s,
            temperature_c=capture.temperature_c,
            lost_images=self._lost,
        )
        self.counters.frames += 1
        self._lost = 0
        self._number += 1
        return frame

    # --- under _control ----------------------------------------------------------------------

    def _apply(self, sequence: Sequence) -> None:
        epoch = self._applied.epoch + 1
        self._applied = self._capabilities.apply(sequence, epoch=epoch)
        self._takes = []
        with self._arrived:
            self._kept = None

    def _begin(self) -> None:
        """Let the device capture, and a thread receive."""
        self._kept, self._expected, self._takes = None, None, []
        self._heard_s = self._clock.now_s()
        self._asked(lambda: self._device.start(self._applied.sequence.exposure_s))
        ended = threading.Event()
        thread = threading.Thread(
            target=self._receive, args=(self._device, ended), name="free-running", daemon=True
        )
        self._receiving = thread, ended
        thread.start()

    def _end(self) -> None:
        """Let the device capture no more; its light goes off before the thread has ended."""
        receiving, self._receiving = self._receiving, None
        if receiving is not None:
            receiving[1].set()
        try:
            self._asked(self._device.light_off)
        finally:
            if receiving is not None:
                receiving[0].join()
            with self._arrived:
                self._kept = None
                self._arrived.notify_all()

    def _lose(self) -> None:
        self._state = CameraState.DISCONNECTED
        with suppress(CameraError):
            self._end()

    def _asked(self, request: Callable[[], _T]) -> _T:
        """Return the answer to a request; a loss disconnects the camera."""
        try:
            return request()
        except CameraLost:
            self._state = CameraState.DISCONNECTED
            raise

    # --- on a thread of its own --------------------------------------------------------------

    def _receive(self, device: FreeRunningDevice, ended: threading.Event) -> None:
        while not ended.is_set():
            found: Capture | CameraError | None
            try:
                found = device.receive(RECEIVE_S)
            except CameraError as error:
                found = error
            except Exception as error:  # of a plug-in: the camera fails, and says of what
                found = CameraLost(f"receive() raised {error!r}")
            if found is None:
                continue
            with self._arrived:
                if ended.is_set():
                    return
                self._kept = found
                if isinstance(found, Capture):
                    self._device_s, self._heard_s = found.device_time_s, self._clock.now_s()
                self._arrived.notify_all()
            if isinstance(found, CameraError):
                return


def capabilities_of(about: Description, renderer: Renderer) -> Capabilities:
    """Return what a sequence can ask of a device: takes, and its exposure where that can be set."""
    frequencies_hz = [each.frequency_hz for each in about.measurements]
    base_hz, multiples = common_base(frequencies_hz, about.max_range_m)
    images = len(multiples) * len(renderer.phases_rad)
    period_s = 1 / (about.frame_rate_hz * images)
    exposure_s = min(getattr(about.measurements[0], "exposure_s", period_s), period_s)
    least_s = about.min_exposure_s or exposure_s
    return Capabilities(
        model=about.model,
        serial=about.serial,
        firmware=about.firmware,
        protocol_version=2,
        width=about.width,
        height=about.height,
        bits=BITS,
        readout_s=period_s - exposure_s,
        streaming_readout_s=period_s - exposure_s,
        tuning_step_hz=base_hz,
        min_frequency_hz=base_hz,
        max_frequency_hz=base_hz * multiples[-1],
        max_harmonics=len(multiples),
        min_exposure_s=least_s,
        max_exposure_s=about.max_exposure_s or max(least_s, exposure_s),
        max_takes=_MOST_TAKES,
        sampling=Sampling(multiples, renderer.phases_rad, about.max_range_m),
        dark_dn=renderer.dark_dn,
        heartbeat_s=about.heartbeat_s,
        clock=about.clock,
    )
