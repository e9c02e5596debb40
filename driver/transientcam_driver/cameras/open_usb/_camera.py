"""A camera behind docs/usb-protocol.md: configure it, start it, take its frames."""

import math
import warnings
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from transientcam_driver.camera import (
    IMAGE_HEADER_BYTES,
    AppliedSequence,
    CameraState,
    DeviceState,
    HostCamera,
    RawFrame,
    Simulation,
    Status,
)
from transientcam_driver.cameras.open_usb._receiving import Receiver
from transientcam_driver.cameras.open_usb._transport import VENDOR_OUT, UsbTransport
from transientcam_driver.cameras.open_usb.protocol import (
    CAPS_ROOM_BYTES,
    LAST_ERROR_BYTES,
    STATUS_BYTES,
    TIME_BYTES,
    Commitment,
    Request,
    SequenceWords,
    unpack_capabilities,
    unpack_last_error,
    unpack_status,
    unpack_time,
)
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import (
    CameraError,
    CameraFault,
    CameraLost,
    DeviceRefused,
    FrameTimeout,
    NotStreaming,
    ProtocolError,
    TransferOverflow,
    TransferStalled,
)
from transientcam_driver.sequence import Sequence
from transientcam_supervisor import OffSwitch, UsbControl, UsbReset

READ_S = 0.1
"""Longest single read: how long a stop or an interrupt may have to wait for a reader."""
_BEATS_PER_TIMEOUT = 4
_PERIOD_RTOL = 0.01  # of the time from image to image, which capabilities give to the nanosecond


class UsbCamera(HostCamera):
    """An AMCW lidar on USB, real or simulated, owned by this process: a `Camera`.

    Methods may be called from any thread, ``read_frame`` from one at a time. Images are read on
    the thread that calls ``read_frame``, which also sends the heartbeat: the light is on only
    while frames are read. When none is read for longer than the device's heartbeat, the device
    switches itself off, and the next ``read_frame`` starts it again.

    The light goes off with ``stop``, ``safe_off`` and ``close``, when the object is collected or
    the interpreter ends, and by the device's own watchdog when the process dies.

    ``connect``: finds and claims the device with a serial number, or any when it is None.
    ``clock``: real time by default.
    ``simulation``: the handle on a simulated camera; None for a real one.
    ``sequence``: what to configure first; by default the nearest that the camera can do to
    ``Sequence()``.
    """

    def __init__(
        self,
        connect: Callable[[str | None], UsbTransport],
        *,
        clock: Clock | None = None,
        simulation: Simulation | None = None,
        sequence: Sequence | None = None,
    ) -> None:
        super().__init__(clock or RealClock(), simulation)
        self._connect = connect
        self._requested = sequence
        self._heartbeat_s = -math.inf
        self._stalled = False
        self._epoch = 0
        self._open(None)

    # --- state and methods -------------------------------------------------------------------

    @property
    def off_switch(self) -> OffSwitch:
        """The request that is never refused; else a reset of the port (usb-protocol 9)."""
        steps = UsbControl(VENDOR_OUT, Request.SAFE_OFF), UsbReset()
        return OffSwitch(self._transport.node, steps)

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence; while streaming, the next frame is the new sequence's.

        Frames of the sequence before are not delivered any more once this returns.
        Raises SequenceError where the sequence is not possible; nothing was changed. Raises
        CameraLost where the camera is gone; the sequence is not remembered.
        """
        self._capabilities.validate(sequence)
        with self._control:
            applied = self._configure(sequence)
            self._requested = sequence
            return applied

    def start(self) -> None:
        """Switch the light on and capture frames back to back."""
        with self._control:
            self._start()
            self._resume = True

    def stop(self) -> None:
        """Switch the light off; a ``read_frame`` that is waiting raises NotStreaming."""
        self._off(Request.STOP)

    def safe_off(self) -> None:
        """Switch the light off by the request that a device always honours."""
        self._off(Request.SAFE_OFF)

    def status(self) -> Status:
        """Read the device's status."""
        with self._control:
            return unpack_status(self._request_in(Request.GET_STATUS, length=STATUS_BYTES))

    def device_time_s(self) -> float:
        """Read the device's clock: seconds since power-up."""
        with self._control:
            return unpack_time(self._request_in(Request.GET_TIME, length=TIME_BYTES))

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next complete frame; raises what `Camera.read_frame` does.

        Raises ProtocolError where none is complete in time because images have another size than
        the capabilities say.
        """
        with self._reading:
            end_s = self._clock.now_s() + timeout_s
            while True:
                self._keep_alive()
                if (frame := self._receiver.take()) is not None:
                    return frame
                left_s = end_s - self._clock.now_s()
                if left_s <= 0:
                    self._receiver.require_images_of_the_size_announced()
                    raise FrameTimeout(timeout_s)
                if not self._read(min(left_s, READ_S)):
                    self._check_silence()

    def reconnect(self) -> None:
        """Find the device again after CameraLost, as `Camera.reconnect` says.

        A CameraNotFound where it is still absent; else it cannot be opened: not yet (a node without
        its permissions, a second unplugging), or another program has claimed it.
        """
        with self._reading, self._control:
            self._require_open()
            if self._state is not CameraState.DISCONNECTED:
                return
            self._close_transport()
            self._open(self._capabilities.serial)
            if self._resume:
                self._start()

    def close(self) -> None:
        """Switch the light off and give the device back; may be called twice."""
        with self._control:
            if self._closed:
                return
            self._closed = True
            self._resume = False
            with suppress(CameraError):  # the light of a lost camera is the watchdog's
                self._transport.control_out(Request.SAFE_OFF)
            self._state = CameraState.DISCONNECTED
        with self._reading:  # the device must not be closed while a thread reads
            self._close_transport()

    # --- connection ------------------------------------------------------------------------

    def _open(self, serial: str | None) -> None:
        self._state = CameraState.CONNECTING
        try:
            self._transport = self._connect(serial)
        except CameraError:
            self._state = CameraState.DISCONNECTED
            raise
        self._release = weakref.finalize(self, _release, self._transport)
        try:
            # usb-protocol 9: also where the last owner left the light on
            self._transport.control_out(Request.SAFE_OFF)
            capabilities = unpack_capabilities(
                self._request_in(Request.GET_CAPS, length=CAPS_ROOM_BYTES)
            )
            serial = capabilities.serial + self._transport.suffix
            self._capabilities = replace(capabilities, serial=serial)
            self._transport.expect_transfers(IMAGE_HEADER_BYTES + self._capabilities.image_bytes)
            self._receiver = Receiver(self._capabilities, self.counters)
            self._configure(self._requested or self._capabilities.nearest(Sequence()))
        except BaseException:
            self._close_transport()
            self._state = CameraState.DISCONNECTED
            raise
        self._stalled = False
        self._state = CameraState.IDLE

    def _lose(self) -> None:
        """Mark the device as gone; a reading thread may still use its transport."""
        self._state = CameraState.DISCONNECTED

    def _close_transport(self) -> None:
        """Give the device back; no thread may be reading."""
        self._release.detach()
        self._transport.close()

    # --- requests (under _control) ---------------------------------------------------------

    def _request_in(self, request: Request, *, value: int = 0, length: int) -> bytes:
        with self._translated(request):
            return self._transport.control_in(request, value=value, length=length)

    def _request_out(self, request: Request, data: bytes = b"") -> None:
        with self._translated(request):
            self._transport.control_out(request, data)

    @contextmanager
    def _translated(self, request: Request) -> Iterator[None]:
        """Around a request: a stall becomes DeviceRefused, a loss disconnects the camera."""
        self._require_connected()
        try:
            try:
                yield
            except TransferStalled as stall:
                raise self._refusal(request) from stall
        except CameraLost:
            self._lose()
            raise

    def _refusal(self, request: Request) -> DeviceRefused:
        """Read why the device stalled a request (usb-protocol 7, 10.5)."""
        try:
            answer = self._transport.control_in(Request.GET_LAST_ERROR, length=LAST_ERROR_BYTES)
        except TransferStalled:  # usb-protocol 10.5
            return DeviceRefused(request.name, "NONE", "it does not say why")
        refused, code, detail = unpack_last_error(answer)
        if refused != request.name:  # usb-protocol 10.5: the reason of an earlier request
            return DeviceRefused(request.name, "NONE", "it does not say why")
        return DeviceRefused(refused, code, detail)

    def _configure(self, sequence: Sequence) -> AppliedSequence:
        words = SequenceWords.of(sequence, self._capabilities)
        self._request_out(Request.SET_SEQUENCE, words.pack())  # usb-protocol 5.1: staged
        with self._receiver.lock:
            # usb-protocol 3.1: the new epoch is above this one, also after a power cycle
            answer = Commitment.unpack(
                self._request_in(Request.COMMIT, value=self._epoch, length=Commitment.MOST_BYTES)
            )
            really_set = answer.words.sequence(self._capabilities)
            # usb-protocol 8.4, 10.12
            period_s = really_set.exposure_s + self._capabilities.streaming_readout_s
            if (
                answer.images != really_set.images
                or answer.epoch <= self._epoch
                or not math.isclose(answer.image_period_ns / 1e9, period_s, rel_tol=_PERIOD_RTOL)
            ):
                raise ProtocolError(f"COMMIT answered with {answer}")
            self._epoch = answer.epoch
            self._applied = self._capabilities.describe(really_set, epoch=answer.epoch)
            self._receiver.switch(self._applied, first_image=answer.first_image)
        return self._applied

    def _start(self) -> None:
        self._require_open()
        with self._receiver.lock:
            self._request_out(Request.STOP)  # usb-protocol 3: no image is exposed until START
            self._receiver.restart(first_image=self.status().next_image)
            self._request_out(Request.START)
            self._heartbeat_s = self._clock.now_s()
            self._state = CameraState.STREAMING

    def _off(self, request: Request) -> None:
        with self._control:
            self._resume = False
            try:
                self._request_out(request)
            except DeviceRefused:
                self._request_out(Request.SAFE_OFF)  # usb-protocol 9, 10.6: never refused
            self._state = CameraState.IDLE

    # --- images (under _reading) -----------------------------------------------------------

    def _keep_alive(self) -> None:
        """Send the heartbeat when it is due; start again when it was missed (usb-protocol 3.2)."""
        with self._control:
            self._require_connected()
            if self._state is not CameraState.STREAMING:
                raise NotStreaming(self._state)
            silent_s = self._clock.now_s() - self._heartbeat_s
            if silent_s >= self._capabilities.heartbeat_s:
                self._require_no_other_end()
                self._start()  # the light is off by now, and images in the FIFO are old
            elif silent_s >= self._capabilities.heartbeat_s / _BEATS_PER_TIMEOUT:
                self._request_out(Request.HEARTBEAT)
                self._heartbeat_s = self._clock.now_s()

    def _read(self, timeout_s: float) -> bool:
        """Take one transfer; return whether anything came."""
        try:
            data = self._transport.read(timeout_s=timeout_s)
        except TransferStalled:
            self._clear_stall()
            return True
        except TransferOverflow:  # usb-protocol 10.3
            self._receiver.resynchronise()
            return True
        except CameraLost:
            with self._control:
                self._require_open()  # closed by another thread: no loss
                self._lose()
            raise
        if not data:
            return False
        self._stalled = False
        self._receiver.feed(data, host_time_s=self._clock.unix_s())
        return True

    def _clear_stall(self) -> None:
        """Clear the halt once; a second one in a row resets the device (usb-protocol 10.2)."""
        with self._control:
            try:
                if not self._stalled:
                    self._stalled = True
                    self._transport.clear_halt()
                    return
                self._transport.reset()
            except CameraLost:
                self._lose()
                raise
            self._lose()
            raise CameraLost("the image endpoint stalled twice; the device was reset")

    def _check_silence(self) -> None:
        """Read the status after a read without an image (usb-protocol 10.1)."""
        with self._control:
            if self._state is not CameraState.STREAMING:
                return  # stopped meanwhile: _keep_alive raises
            if self._require_no_other_end():
                self._start()

    def _require_no_other_end(self) -> bool:
        """Return whether the watchdog ended the capture; another end is not undone.

        It may have been switched off by another process (`off_switch`).
        """
        status = self.status()
        if status.state is DeviceState.STREAMING or status.watchdog_tripped:
            return status.watchdog_tripped
        self._state = CameraState.FAULTED
        raise CameraFault(
            "it stopped by itself" if status.interlock_closed else "the interlock was opened"
        )


def _release(transport: UsbTransport) -> None:
    """Light off when a camera is collected, or the interpreter ends, without close()."""
    warnings.warn("a camera was left open; use close() or `with`", ResourceWarning, stacklevel=2)
    with suppress(CameraError):
        transport.control_out(Request.SAFE_OFF)
    transport.close()
