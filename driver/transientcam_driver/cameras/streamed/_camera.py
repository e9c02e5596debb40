"""What cameras share that stream once they are started, whoever reads."""

import math
import threading
import time
import warnings
import weakref
from abc import abstractmethod
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any, Final, Generic, Protocol, TypeVar, cast

from transientcam_driver.camera import (
    AppliedSequence,
    CameraState,
    Capabilities,
    FactoryCalibration,
    HostCamera,
    RawFrame,
    Simulation,
    Status,
    finite,
    require,
    require_image,
    require_stated,
)
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import (
    CameraError,
    CameraLost,
    CameraNotFound,
    DriverError,
    FrameTimeout,
    NotStreaming,
)
from transientcam_driver.sequence import Sequence

SILENCE_S: Final = 2.0
UNREAD_S: Final = 2.0
HANGS_S: Final = 5.0
SLOW_S: Final = 30.0
"""When a call of a plug-in's device counts as hung; the latter is of connecting and starting."""
READ_S: Final = 0.1
"""Longest wait for a frame in one go: how long a loss may stay unnoticed."""


class _Device(Protocol):
    def close(self) -> None:
        """Give the device back, its light off; never fails."""


_D = TypeVar("_D", bound=_Device)
_A = TypeVar("_A")
_T = TypeVar("_T")


def same(
    connect: Callable[[], _D],
    serial_of: Callable[[_D], str],
    simulation: Simulation | None = None,
    limits_s: Mapping[str, float] | None = None,
) -> Callable[[str | None], _D]:
    """Return what connects a plug-in's device, whose calls then end (`within`).

    It raises CameraNotFound where the serial number is another one. ``limits_s``: of calls by their
    names, other than `HANGS_S`. A simulated device takes as long as it is computed.
    """

    def again(serial: str | None) -> _D:
        if simulation is not None:
            device = connect()
        else:
            device = cast("_D", _Bounded(within(SLOW_S, "connect", connect), limits_s or {}))
        if serial in (None, serial_of(device)):
            return device
        device.close()
        raise CameraNotFound(str(serial))

    return again


def within(limit_s: float, name: str, call: Callable[..., _T], *given: Any) -> _T:
    """Return what a call of a plug-in returns, on a thread that is left behind if it hangs.

    Without a limit the thread is the caller's. Raises CameraLost, naming the call, where it takes
    longer or raises what is no DriverError.
    """
    answer: Future[_T] = Future()

    def run() -> None:
        try:
            answer.set_result(call(*given))
        except DriverError as error:  # raised below
            answer.set_exception(error)
        except BaseException as error:  # also SystemExit, which would end the thread that asks
            answer.set_exception(CameraLost(f"{name}() raised {error!r:.200}"))

    try:
        thread = threading.Thread(target=run, name=f"device-{name}", daemon=True)
        (thread.start if math.isfinite(limit_s) else run)()
    except RuntimeError:  # none starts while the interpreter ends
        run()
    try:
        return answer.result(limit_s if math.isfinite(limit_s) else None)
    except TimeoutError:
        raise CameraLost(f"{name}() has not returned for {limit_s:g} s") from None


class _Bounded:
    """A device whose methods end."""

    def __init__(self, device: Any, limits_s: Mapping[str, float]) -> None:
        self._device, self._limits_s = device, limits_s

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._device, name)
        if not callable(found):
            return found
        return partial(within, self._limits_s.get(name, HANGS_S), name, found)


class StreamedCamera(HostCamera, Generic[_D, _A]):
    """A `Camera` of a device that streams; of frames and of requests to it a subclass knows.

    While it is started and no frame is read for ``unread_s``, a thread here switches it off, and
    the next ``read_frame`` on again.

    ``connect``: opens the camera with a serial number, any where it is None.
    ``clock``: of the times that frames carry; real time by default.
    ``simulation``: the handle on an emulated camera; None for a real one.
    ``silence_s``: without a whole frame for so long the camera is lost.
    ``unread_s``: without a reader for so long, or twice as long, the light goes off.
    ``now_s``: monotonic time, by which waits end.
    Raises CameraError as ``connect``.
    """

    def __init__(
        self,
        connect: Callable[[str | None], _D],
        *,
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
        self._epoch = 0
        self._lit = False
        self._heard = 0, 0.0  # whole images, and when their count had last changed
        self._own(connect(None))
        try:
            with self._control:
                self._describe()
                _require_usable(self._capabilities, self.factory)
                self._apply(self._capabilities.nearest(Sequence()))
        except BaseException:
            self._give_back()
            raise
        self._state = CameraState.IDLE
        self._reads = 0  # of which a thread sees whether they go on
        self._ended = threading.Event()
        watching = threading.Thread(target=self._watch, args=(unread_s,), name="camera-watch")
        watching.daemon = True
        self._watching = watching if math.isfinite(unread_s) else None
        if self._watching is not None:
            self._watching.start()

    # --- what a subclass does, under _control but for `_take` -----------------------------------

    @abstractmethod
    def _describe(self) -> None:
        """Set ``_capabilities`` and ``factory`` by the device."""

    @abstractmethod
    def _begin(self) -> None:
        """Let the device stream, its light on, and forget what had come before."""

    @abstractmethod
    def _end(self) -> None:
        """Let the device stream no more; it also releases the reader."""

    @abstractmethod
    def _release_reader(self) -> None:
        """Let `_take` return: nothing will come any more."""

    @abstractmethod
    def _take(self, timeout_s: float) -> _A | None:
        """Return what has come, or None in time. Raises CameraError: a loss disconnects it."""

    @abstractmethod
    def _collected(self, arrival: _A) -> RawFrame | None:
        """Add what has come to the frame; return it once it has all takes."""

    @abstractmethod
    def _check(self) -> float | None:
        """Ask the device whether it is there; return its temperature, if it knows one."""

    def _temperature_c(self) -> float | None:
        """Ask for the temperature, and so whether the device is there."""
        return self._check()

    def _set(self, applied: AppliedSequence) -> None:
        """Let the device do another sequence, and drop the frame that was begun."""
        self._applied = applied

    def _silence(self) -> str:
        """Say what came in place of frames."""
        return "nothing since it was opened"

    # --- state -------------------------------------------------------------------------------

    def status(self) -> Status:
        """Return what is known here, and what the device answers."""
        with self._control:
            self._require_connected()
            temperature_c = finite(self._asked(self._temperature_c))
            return self._status(light_on=self._lit, temperature_c=temperature_c)

    # --- sequence and light ------------------------------------------------------------------

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence; takes of the frame begun are dropped."""
        self.validate(sequence)
        with self._control:
            self._require_connected()
            self._asked(lambda: self._apply(sequence))
            return self._applied

    def start(self) -> None:
        """Switch the light on and capture frames back to back."""
        with self._control:
            self._require_connected()
            self._reads += 1
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
            self._give_back()
            self._own(self._connect(self._capabilities.serial))
            try:
                self._apply(self._applied.sequence)
            except BaseException:
                self._give_back()
                raise
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
            self._release_reader()
        self._ended.set()
        if self._watching is not None:
            self._watching.join()
        with self._reading, self._control:
            self._lit = False
            self._give_back()

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
                arrival = self._taken(max(0.0, min(left_s, READ_S)))
                if arrival is not None:
                    frame = self._frame_of(arrival)
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
            self._reads += 1
            self._light_on()

    def _taken(self, timeout_s: float) -> _A | None:
        try:
            return self._take(timeout_s)
        except CameraLost as error:
            with self._control:
                self._require_open()  # closed by another thread: no loss
                self._loss = error.reason
                self._lose()
            raise

    def _frame_of(self, arrival: _A) -> RawFrame | None:
        with self._control:
            if self._state is not CameraState.STREAMING:  # stopped meanwhile
                return None
            frame = self._collected(arrival)
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
                self._check()
            finally:
                self._lose()
        raise CameraLost(f"no whole frame within {self._silence_s:g} s ({self._silence()})")

    def _watch(self, unread_s: float) -> None:
        """Switch the light off without readers; the next `read_frame` needs it again."""
        reads = -1
        while not self._ended.wait(unread_s):
            if reads == self._reads:
                with self._control, suppress(CameraError):  # the next request fails in the same way
                    if self._lit:
                        self._light_off()
            reads = self._reads

    def _own(self, device: _D) -> None:
        self._device = device
        self._release = weakref.finalize(self, _left_open, device)

    def _give_back(self) -> None:
        """Close the device, once."""
        if self._release.detach():
            with suppress(CameraLost):  # it never fails, but may hang
                self._device.close()

    # --- under _control ----------------------------------------------------------------------

    def _apply(self, sequence: Sequence) -> None:
        self._epoch += 1
        self._set(self._capabilities.apply(sequence, epoch=self._epoch))

    def _light_on(self) -> None:
        if not self._lit:
            self._heard = self.counters.images, self._now_s()
            self._asked(self._begin)
            self._lit = True
        self._state = CameraState.STREAMING

    def _light_off(self) -> None:
        self._asked(self._end)
        self._lit = False

    def _lose(self) -> None:
        """Mark the camera as gone, and switch off what still answers."""
        self._state = CameraState.DISCONNECTED
        self._release_reader()
        self._give_back()
        self._lit = False

    def _asked(self, request: Callable[[], _T]) -> _T:
        """Return the answer to requests; a loss disconnects the camera."""
        try:
            return request()
        except CameraLost as error:
            self._loss = error.reason
            self._lose()
            raise


def _require_usable(about: Capabilities, factory: object) -> None:
    """Refuse what a package states of its camera that nothing could be done with."""
    require_stated(about)
    require_image(about.width, about.height, about.bits)
    require("factory", isinstance(factory, FactoryCalibration | None), "a calibration", factory)
    if factory is not None:
        require_stated(factory)


def _left_open(device: _Device) -> None:
    """Light off when the interpreter ends without close()."""
    warnings.warn("a camera was left open; use close() or `with`", ResourceWarning, stacklevel=2)
    device.close()
