"""The device's side of the protocol: vendor requests in, answers and image packets out.

Pure: time is passed in, images come from a renderer, and nothing here depends on a transport.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import (
    IMAGE_HEADER_BYTES,
    Capabilities,
    DeviceState,
    Status,
    StatusFlag,
)
from transientcam_driver.cameras.open_usb.protocol import (
    Commitment,
    ErrorCode,
    ImageFlag,
    ImageHeader,
    Request,
    SequenceWords,
    pack_capabilities,
    pack_last_error,
    pack_status,
    pack_time,
    payload_checksum,
    phase_word,
)
from transientcam_driver.errors import DriverError, ProtocolError
from transientcam_driver.sequence import ImageLabel, Sequence
from transientcam_simulation.emulated._open_usb.exposures import Exposed, Exposures


class Refusal(Exception):  # noqa: N818  (an answer of the device, not a failure)
    """The device stalls the request; GET_LAST_ERROR has the reason (usb-protocol 7)."""

    def __init__(self, code: ErrorCode, detail: str) -> None:
        super().__init__(code, detail)
        self.code = code
        self.detail = detail


class Renderer(Protocol):
    """What renders the images of the sensor."""

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        """Set the sequence of the images."""
        ...

    def prepare(self) -> None:
        """Compute what images of the sequence need, so that none of them is late."""
        ...

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        """Return the digital numbers (H, W) of the image with this sequence number."""
        ...

    def temperature_c(self, device_time_s: float) -> float:
        """Temperature of the sensor."""
        ...


class Firmware:
    """A camera without its cable.

    Images are exposed by the clock alone (see ``Exposures``), one every exposure plus streaming
    read-out; only those that are read are rendered.
    """

    def __init__(
        self, capabilities: Capabilities, renderer: Renderer, *, power_on_s: float
    ) -> None:
        self.capabilities = capabilities
        self._renderer = renderer
        self._power_on_s = power_on_s
        self._packet_bytes = IMAGE_HEADER_BYTES + capabilities.image_bytes
        self._exposures = Exposures(capabilities.fifo_bytes // self._packet_bytes)
        self._staged: SequenceWords | None = None
        self._words: SequenceWords | None = None
        self._labels: tuple[ImageLabel, ...] = ()
        self._epoch = 0
        self._heartbeat_s = power_on_s
        self._begun_s: float | None = None
        self._watchdog_tripped = False
        self._interlock_closed = True
        self._faulted = False
        self._last_error = (ErrorCode.NONE, 0, "")
        self._ready: tuple[Exposed, bytes] | None = None  # an image rendered ahead

    def set_interlock(self, now_s: float, *, closed: bool) -> None:
        """Open or close the safety interlock; opening switches the light off (usb-protocol 9)."""
        self._advance(now_s)
        self._interlock_closed = closed
        if not closed and self._exposures.running:
            self._exposures.end()
            self._faulted = True

    # --- requests -------------------------------------------------------------------------

    def control_in(self, request: int, value: int, index: int, *, now_s: float) -> bytes:
        """Answer a vendor request from device to host; raise Refusal for a stall."""
        self._advance(now_s)
        if request == Request.GET_LAST_ERROR:
            code, of, detail = self._last_error
            return pack_last_error(code, of, detail)
        with_answer = {
            Request.GET_CAPS: lambda: pack_capabilities(self.capabilities),
            Request.COMMIT: lambda: self._commit(value | index << 16, now_s).pack(),
            Request.GET_STATUS: lambda: pack_status(self._status(now_s)),
            Request.GET_TIME: lambda: pack_time(now_s - self._power_on_s),
        }
        try:
            if request not in with_answer:
                raise Refusal(ErrorCode.UNKNOWN_REQUEST, f"no request {request:#04x} to read")
            return with_answer[Request(request)]()
        except Refusal as refusal:
            self._last_error = (refusal.code, request, refusal.detail)
            raise

    def resume(self, now_s: float) -> None:
        """Begin the exposures that a request has just begun, now.

        The emulator has prepared its light meanwhile, which would take a device no time.
        """
        begun_s, self._begun_s = self._begun_s, None
        if begun_s is None or not self._exposures.running:
            return
        self._heartbeat_s += now_s - begun_s
        self._begin(now_s)

    def control_out(self, request: int, data: bytes, *, now_s: float) -> None:
        """Execute a vendor request from host to device; raise Refusal for a stall."""
        self._advance(now_s)
        try:
            match request:
                case Request.SET_SEQUENCE:
                    self._stage(data)
                case Request.START:
                    self._start(now_s)
                case Request.STOP | Request.SAFE_OFF:  # usb-protocol 3, 9: in every state
                    self._exposures.end()
                case Request.FLUSH:
                    self._flush()
                case Request.HEARTBEAT:  # usb-protocol 3.2
                    self._heartbeat_s = now_s
                case _:
                    raise Refusal(ErrorCode.UNKNOWN_REQUEST, f"no request {request:#04x} to write")
        except Refusal as refusal:
            self._last_error = (refusal.code, request, refusal.detail)
            raise

    def _stage(self, data: bytes) -> None:
        if len(data) not in (SequenceWords.BYTES, SequenceWords.MOST_BYTES):
            detail = f"{len(data)} bytes, {SequenceWords.BYTES} needed"
            raise Refusal(ErrorCode.BAD_LENGTH, detail)
        try:
            words = SequenceWords.unpack(data)
            self.capabilities.validate(words.sequence(self.capabilities))
        except ProtocolError as error:
            raise Refusal(ErrorCode.BAD_VALUE, error.detail) from error
        except DriverError as error:
            raise Refusal(ErrorCode.BAD_VALUE, str(error)) from error
        self._staged = words  # usb-protocol 3: nothing changes until COMMIT

    def _commit(self, epoch_above: int, now_s: float) -> Commitment:
        if self._staged is None and self._words is None:
            raise Refusal(ErrorCode.NOT_CONFIGURED, "no sequence staged")
        if self._staged is not None:  # usb-protocol 3.1: else a repeated COMMIT changes nothing
            streaming = self._exposures.running
            self._exposures.end()
            self._flush()
            self._words, self._staged = self._staged, None
            sequence = self._words.sequence(self.capabilities)
            self._labels = sequence.labels_at(self.capabilities.low_frequency_hz)
            self._renderer.configure(sequence, self._labels)
            self._epoch = max(self._epoch, epoch_above) + 1  # usb-protocol 3.1
            if streaming:
                self._prepare_and_begin(now_s)
        assert self._words is not None  # noqa: S101  (refused above otherwise)
        return Commitment(
            epoch=self._epoch,
            images=len(self._labels),
            first_image=self._exposures.next_image,
            image_period_ns=round(self._period_s() * 1e9),
            words=self._words,
        )

    def _start(self, now_s: float) -> None:
        if self._words is None:
            raise Refusal(ErrorCode.NOT_CONFIGURED, "no sequence committed")
        if not self._interlock_closed:
            raise Refusal(ErrorCode.INTERLOCK_OPEN, "the interlock is open")
        self._exposures.end()
        self._flush()  # usb-protocol 3: START empties the FIFO
        self._faulted = False  # usb-protocol 2
        self._watchdog_tripped = False
        self._heartbeat_s = now_s
        self._prepare_and_begin(now_s)

    def _status(self, now_s: float) -> Status:
        flags = StatusFlag(0)
        state = DeviceState.FAULTED if self._faulted else DeviceState.IDLE
        if self._exposures.running:  # usb-protocol 2: light in STREAMING and in no other state
            state = DeviceState.STREAMING
            flags |= StatusFlag.LIGHT_ON
        if self._interlock_closed:
            flags |= StatusFlag.INTERLOCK_CLOSED
        if self._watchdog_tripped:
            flags |= StatusFlag.WATCHDOG_TRIPPED
        if self._staged is not None:
            flags |= StatusFlag.SEQUENCE_STAGED
        device_time_s = now_s - self._power_on_s
        return Status(
            state=state,
            flags=flags,
            epoch=self._epoch,
            next_image=self._exposures.next_image,
            device_time_s=device_time_s,
            dropped_images=self._exposures.dropped,
            fifo_bytes=len(self._exposures) * self._packet_bytes,
            fifo_high_water_bytes=self._exposures.high_water * self._packet_bytes,
            temperature_c=self._renderer.temperature_c(device_time_s),
        )

    # --- images ---------------------------------------------------------------------------

    def due_s(self) -> float | None:
        """When the next image can be read: in the past if it can be now, None if never."""
        image = self._exposures.upcoming()
        return None if image is None else image.due_s

    def prepare(self) -> None:
        """Render the image that is read next, ahead of its time."""
        image = self._exposures.upcoming()
        if image is not None:
            self._packet(image)

    def read(self, *, now_s: float) -> bytes | None:
        """Take the oldest image packet out of the FIFO, if there is one."""
        self._advance(now_s)
        image = self._exposures.take()
        if image is None:
            return None
        packet = self._packet(image)
        self._ready = None
        return packet

    def _prepare_and_begin(self, now_s: float) -> None:
        self._renderer.prepare()
        self._begin(now_s)
        self._begun_s = now_s

    def _begin(self, now_s: float) -> None:
        self._exposures.begin(now_s, period_s=self._period_s(), count=len(self._labels))

    def _flush(self) -> None:
        self._exposures.flush()
        self._ready = None

    def _period_s(self) -> float:
        assert self._words is not None  # noqa: S101  (callers have a sequence)
        # usb-protocol 8.4
        return self._words.exposure_ns / 1e9 + self.capabilities.streaming_readout_s

    def _advance(self, now_s: float) -> None:
        """Advance exposures and the watchdog up to now."""
        if not self._exposures.running:
            return
        trip_s = self._heartbeat_s + self.capabilities.heartbeat_s
        self._exposures.advance(min(now_s, trip_s))
        if now_s > trip_s:  # usb-protocol 3.2
            self._watchdog_tripped = True
            self._exposures.end()

    def _packet(self, image: Exposed) -> bytes:
        if self._ready is not None and self._ready[0] == image:
            return self._ready[1]
        label = self._labels[image.index]
        device_time_s = image.begin_s - self._power_on_s
        pixels = self._renderer.image(label, number=image.number, device_time_s=device_time_s)
        payload = pixels.astype("<u2", copy=False).tobytes()  # usb-protocol 8.1
        assert self._words is not None  # noqa: S101  (what is exposed has a sequence)
        header = ImageHeader(
            flags=self._image_flags(image, label), epoch=self._epoch, frame=image.frame,
            number=image.number, index=image.index, count=len(self._labels),
            tuning_word=self._words.word(label.harmonic), phase=phase_word(label.phase_rad),
            harmonic=label.harmonic, exposure_ns=self._words.exposure_ns,
            device_time_ns=round(device_time_s * 1e9),
            temperature_c=self._renderer.temperature_c(device_time_s), payload_bytes=len(payload),
            payload_crc=payload_checksum(payload),
        )  # fmt: skip
        packet = header.pack() + payload
        self._ready = (image, packet)
        return packet

    def _image_flags(self, image: Exposed, label: ImageLabel) -> ImageFlag:
        holds = {
            ImageFlag.ILLUMINATION: label.illumination,
            ImageFlag.FIRST_OF_FRAME: image.index == 0,
            ImageFlag.LAST_OF_FRAME: image.index == len(self._labels) - 1,
            ImageFlag.OVERFLOW: image.after_overflow,
        }
        flags = ImageFlag(0)
        for flag, is_set in holds.items():
            flags |= flag if is_set else ImageFlag(0)
        return flags
