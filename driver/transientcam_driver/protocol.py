"""The camera's USB protocol: requests and image packets as bytes.

Pure: nothing here knows a transport or a clock. Both ends use it, the driver and the simulated
firmware. The specification is docs/usb-protocol.md; all numbers are little-endian.
"""

import math
import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from crc32c import crc32c

from transientcam_driver.capabilities import IMAGE_HEADER_BYTES, Capabilities
from transientcam_driver.errors import FirmwareTooOld, ProtocolError
from transientcam_driver.sequence import Scheme, Sequence, SubPhases, Zeroth

VENDOR_ID = 0x1209
PRODUCT_ID = 0x0001
"""A test number of pid.codes; a product gets its own."""
VENDOR_CLASS = 0xFF
IMAGE_ENDPOINT = 0x81
VERSION = 1

_ZEROTHS: tuple[Zeroth, ...] = ("on-off", "low-frequency", "estimated")
_SCHEMES: tuple[Scheme, ...] = ("none", "arccos", "harmonic-cancellation")


class Request(IntEnum):
    """bRequest of the vendor requests to the device."""

    GET_CAPS = 0x01
    SET_SEQUENCE = 0x02
    COMMIT = 0x03
    START = 0x04
    STOP = 0x05
    FLUSH = 0x06
    GET_STATUS = 0x07
    GET_TIME = 0x08
    HEARTBEAT = 0x09
    SAFE_OFF = 0x0A
    GET_LAST_ERROR = 0x0B


class ErrorCode(IntEnum):
    """Why the device stalled a request."""

    NONE = 0
    UNKNOWN_REQUEST = 1
    BAD_LENGTH = 2
    BAD_VALUE = 3
    NOT_CONFIGURED = 4
    INTERLOCK_OPEN = 5


class DeviceState(IntEnum):
    """State of the device, in GET_STATUS."""

    IDLE = 0
    STREAMING = 1
    FAULTED = 2


class StatusFlag(IntFlag):
    """Flags of GET_STATUS."""

    LIGHT_ON = 1
    INTERLOCK_CLOSED = 2
    WATCHDOG_TRIPPED = 4
    SEQUENCE_STAGED = 8


class ImageFlag(IntFlag):
    """Flags of an image header."""

    ILLUMINATION = 1
    FIRST_OF_FRAME = 2
    LAST_OF_FRAME = 4
    OVERFLOW = 8
    """The device's FIFO was full just before: images are missing."""


# --- capabilities -----------------------------------------------------------------------------

_CAPS_MAGIC = b"TCCP"
_CAPS = struct.Struct("<4sHH32s32s16sHHBBBBBxHHxxIIIIIIIIIII")
CAPS_BYTES = _CAPS.size + 4
CAPS_ROOM_BYTES = 512
"""What a host asks for, so that later fields fit."""


def pack_capabilities(capabilities: Capabilities) -> bytes:
    """Answer to GET_CAPS."""
    c = capabilities
    body = _CAPS.pack(
        _CAPS_MAGIC,
        c.protocol_version,
        CAPS_BYTES,
        c.model.encode(),
        c.serial.encode(),
        c.firmware.encode(),
        c.width,
        c.height,
        c.bits,
        c.max_harmonics,
        c.max_sub_phases,
        _bits(c.schemes, _SCHEMES),
        _bits(c.zeroths, _ZEROTHS),
        c.max_takes,
        c.max_images,
        round(c.tuning_step_hz * 1e6),
        c.tuning_word(c.min_frequency_hz),
        c.tuning_word(c.max_frequency_hz),
        c.tuning_word(c.low_frequency_hz),
        _nanoseconds(c.min_exposure_s),
        _nanoseconds(c.max_exposure_s),
        _nanoseconds(c.readout_s),
        _nanoseconds(c.streaming_readout_s),
        c.fifo_bytes,
        round(c.heartbeat_s * 1e3),
        0,
    )
    return body + struct.pack("<I", crc32c(body))


def unpack_capabilities(data: bytes) -> Capabilities:
    """Read the answer to GET_CAPS.

    Raises
    ------
    FirmwareTooOld
        The device speaks another version.
    ProtocolError
        The block is damaged, or what it says cannot be.
    """
    if len(data) < 8 or data[:4] != _CAPS_MAGIC:
        raise ProtocolError(f"{len(data)} bytes without the mark of capabilities")
    version, length = struct.unpack_from("<HH", data, 4)
    if version != VERSION:
        raise FirmwareTooOld(version, VERSION)
    if length < CAPS_BYTES or len(data) < length:
        raise ProtocolError(f"capabilities of {len(data)} bytes, {max(length, CAPS_BYTES)} needed")
    if crc32c(data[: length - 4]) != struct.unpack_from("<I", data, length - 4)[0]:
        raise ProtocolError("capabilities with a wrong checksum")
    # Later minor revisions append fields before the checksum; the known ones stay in front.
    (
        *_,
        model,
        serial,
        firmware,
        width,
        height,
        bits,
        max_harmonics,
        max_sub_phases,
        schemes,
        zeroths,
        max_takes,
        max_images,
        step_uhz,
        min_word,
        max_word,
        low_word,
        min_exposure_ns,
        max_exposure_ns,
        readout_ns,
        streaming_readout_ns,
        fifo_bytes,
        heartbeat_ms,
        _reserved,
    ) = _CAPS.unpack_from(data)
    step_hz = step_uhz / 1e6
    capabilities = Capabilities(
        model=_text(model),
        serial=_text(serial),
        firmware=_text(firmware),
        protocol_version=version,
        width=width,
        height=height,
        bits=bits,
        readout_s=readout_ns / 1e9,
        streaming_readout_s=streaming_readout_ns / 1e9,
        tuning_step_hz=step_hz,
        min_frequency_hz=min_word * step_hz,
        max_frequency_hz=max_word * step_hz,
        low_frequency_hz=low_word * step_hz,
        max_harmonics=max_harmonics,
        min_exposure_s=min_exposure_ns / 1e9,
        max_exposure_s=max_exposure_ns / 1e9,
        max_takes=max_takes,
        max_sub_phases=max_sub_phases,
        max_images=max_images,
        schemes=_named(schemes, _SCHEMES),
        zeroths=_named(zeroths, _ZEROTHS),
        fifo_bytes=fifo_bytes,
        heartbeat_s=heartbeat_ms / 1e3,
    )
    _check_capabilities(capabilities)
    return capabilities


def _check_capabilities(c: Capabilities) -> None:
    """Refuse what would divide by zero, overflow or never end further up."""
    ranges = (
        ("width", c.width, 1, 4096),
        ("height", c.height, 1, 4096),
        ("bits", c.bits, 1, 16),
        ("harmonics", c.max_harmonics, 1, 255),
        ("sub-phases", c.max_sub_phases, 1, 255),
        ("takes", c.max_takes, 1, 65535),
        ("images", c.max_images, 1, 65535),
        ("tuning step in Hz", c.tuning_step_hz, 1e-6, 1e6),
        ("lowest frequency in Hz", c.min_frequency_hz, 1, c.max_frequency_hz),
        ("shortest exposure in s", c.min_exposure_s, 1e-9, c.max_exposure_s),
        ("heartbeat in s", c.heartbeat_s, 0.01, 3600),
        ("FIFO in bytes", c.fifo_bytes, IMAGE_HEADER_BYTES + c.image_bytes, math.inf),
    )
    for name, value, least, most in ranges:
        if not least <= value <= most:
            raise ProtocolError(f"capabilities with {value} for {name} ({least} to {most})")


# --- sequences --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SequenceWords:
    """A sequence in the integers of the hardware: payload of SET_SEQUENCE, part of COMMIT's answer.

    Frequency j is ``j * base_word`` steps of the synthesiser, so ratios are exact.
    """

    harmonics: int
    zeroth: int
    scheme: int
    sub_phases: int
    base_word: int
    low_word: int
    exposure_ns: int
    takes: int

    _LAYOUT = struct.Struct("<BBBBBxHIII")
    BYTES = _LAYOUT.size

    @classmethod
    def of(cls, sequence: Sequence, capabilities: Capabilities) -> "SequenceWords":
        """Round a sequence to the hardware's grid."""
        low_frequency = sequence.zeroth == "low-frequency"
        return cls(
            harmonics=sequence.harmonics,
            zeroth=_ZEROTHS.index(sequence.zeroth),
            scheme=_SCHEMES.index(sequence.sub_phases.scheme),
            sub_phases=sequence.sub_phases.n,
            base_word=capabilities.tuning_word(sequence.base_frequency_hz),
            low_word=capabilities.tuning_word(capabilities.low_frequency_hz) * low_frequency,
            exposure_ns=_nanoseconds(sequence.exposure_s),
            takes=sequence.takes,
        )

    def sequence(self, capabilities: Capabilities) -> Sequence:
        """Give the integers their meaning back.

        Raises
        ------
        ProtocolError
            A code without a meaning.
        SequenceError
            A field out of every range.
        """
        if self.zeroth >= len(_ZEROTHS) or self.scheme >= len(_SCHEMES):
            raise ProtocolError(f"unknown codes {self.zeroth} (zeroth), {self.scheme} (scheme)")
        return Sequence(
            base_frequency_hz=capabilities.frequency_hz(self.base_word),
            harmonics=self.harmonics,
            zeroth=_ZEROTHS[self.zeroth],
            exposure_s=self.exposure_ns / 1e9,
            takes=self.takes,
            sub_phases=SubPhases(_SCHEMES[self.scheme], self.sub_phases),
        )

    def word(self, harmonic: int) -> int:
        """Tuning word of a harmonic; 0 asks for the one of the zeroth moment."""
        return self.base_word * harmonic if harmonic else self.low_word

    def pack(self) -> bytes:
        """Payload of SET_SEQUENCE."""
        return self._LAYOUT.pack(
            VERSION,
            self.harmonics,
            self.zeroth,
            self.scheme,
            self.sub_phases,
            self.takes,
            self.base_word,
            self.low_word,
            self.exposure_ns,
        )

    @classmethod
    def unpack(cls, data: bytes) -> "SequenceWords":
        """Read the payload of SET_SEQUENCE."""
        if len(data) != cls.BYTES or data[0] != VERSION:
            raise ProtocolError(f"{len(data)} bytes for a sequence of {cls.BYTES}")
        _, harmonics, zeroth, scheme, sub_phases, takes, base, low, exposure = cls._LAYOUT.unpack(
            data
        )
        return cls(harmonics, zeroth, scheme, sub_phases, base, low, exposure, takes)


@dataclass(frozen=True, slots=True)
class Commitment:
    """Answer to COMMIT: the epoch, what was really set, and the number of its first image."""

    epoch: int
    images: int
    first_image: int
    image_period_ns: int
    words: SequenceWords

    _LAYOUT = struct.Struct("<IIQI")
    BYTES = _LAYOUT.size + SequenceWords.BYTES

    def pack(self) -> bytes:
        """Bytes of the answer."""
        front = self._LAYOUT.pack(self.epoch, self.images, self.first_image, self.image_period_ns)
        return front + self.words.pack()

    @classmethod
    def unpack(cls, data: bytes) -> "Commitment":
        """Read the answer."""
        if len(data) != cls.BYTES:
            raise ProtocolError(f"answer of {len(data)} bytes to COMMIT, {cls.BYTES} needed")
        epoch, images, first_image, period_ns = cls._LAYOUT.unpack_from(data)
        words = SequenceWords.unpack(data[cls._LAYOUT.size :])
        return cls(epoch, images, first_image, period_ns, words)


# --- status -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Status:
    """Answer to GET_STATUS.

    ``next_image`` is the sequence number of the image to come, ``dropped_images`` how many the
    device's FIFO had no room for since power-up.
    """

    state: DeviceState
    flags: StatusFlag
    epoch: int
    next_image: int
    device_time_s: float
    dropped_images: int
    fifo_bytes: int
    fifo_high_water_bytes: int
    temperature_c: float

    _LAYOUT = struct.Struct("<BBHIQQIIIhxx")
    BYTES = _LAYOUT.size

    @property
    def light_on(self) -> bool:
        """Whether the light source is enabled."""
        return StatusFlag.LIGHT_ON in self.flags

    @property
    def interlock_closed(self) -> bool:
        """Whether the safety interlock allows the light."""
        return StatusFlag.INTERLOCK_CLOSED in self.flags

    @property
    def watchdog_tripped(self) -> bool:
        """Whether the light went off because no heartbeat came."""
        return StatusFlag.WATCHDOG_TRIPPED in self.flags

    def pack(self) -> bytes:
        """Bytes of the answer."""
        return self._LAYOUT.pack(
            VERSION,
            self.state,
            self.flags,
            self.epoch,
            self.next_image,
            _nanoseconds(self.device_time_s),
            self.dropped_images,
            self.fifo_bytes,
            self.fifo_high_water_bytes,
            _centidegrees(self.temperature_c),
        )

    @classmethod
    def unpack(cls, data: bytes) -> "Status":
        """Read the answer."""
        if len(data) != cls.BYTES or data[0] != VERSION:
            raise ProtocolError(f"status of {len(data)} bytes, {cls.BYTES} needed")
        _, state, flags, epoch, image, time_ns, dropped, fifo, high, centi = cls._LAYOUT.unpack(
            data
        )
        if state not in tuple(DeviceState):
            raise ProtocolError(f"status with the unknown state {state}")
        return cls(
            DeviceState(state),
            StatusFlag(flags),
            epoch,
            image,
            time_ns / 1e9,
            dropped,
            fifo,
            high,
            centi / 100,
        )


_TIME = struct.Struct("<Q")
TIME_BYTES = _TIME.size


def pack_time(device_time_s: float) -> bytes:
    """Answer to GET_TIME: nanoseconds since power-up."""
    return _TIME.pack(_nanoseconds(device_time_s))


def unpack_time(data: bytes) -> float:
    """Read the answer to GET_TIME, in seconds."""
    if len(data) != TIME_BYTES:
        raise ProtocolError(f"time of {len(data)} bytes, {TIME_BYTES} needed")
    return float(_TIME.unpack(data)[0] / 1e9)


_LAST_ERROR = struct.Struct("<HB")
LAST_ERROR_BYTES = 64


def pack_last_error(code: ErrorCode, request: int, detail: str) -> bytes:
    """Answer to GET_LAST_ERROR: code, request that was stalled, a sentence in ASCII."""
    return (_LAST_ERROR.pack(code, request) + detail.encode("ascii", "replace"))[:LAST_ERROR_BYTES]


def unpack_last_error(data: bytes) -> tuple[str, str, str]:
    """Read the answer to GET_LAST_ERROR: request, code and detail, as words."""
    if len(data) < _LAST_ERROR.size:
        raise ProtocolError(f"last error of {len(data)} bytes")
    code, request = _LAST_ERROR.unpack_from(data)
    return (
        Request(request).name if request in tuple(Request) else f"request {request:#04x}",
        ErrorCode(code).name if code in tuple(ErrorCode) else f"error {code}",
        data[_LAST_ERROR.size :].decode("ascii", "replace"),
    )


# --- images -----------------------------------------------------------------------------------

IMAGE_MAGIC = b"TCIM"
_HEADER = struct.Struct("<4sBBHIIQHHIHHIQhxxII")
_CRC = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class ImageHeader:
    """The 64 bytes in front of each image.

    ``number`` counts every image since power-up, also those that were dropped; ``phase`` is in
    1/65536 of a turn; ``device_time_ns`` is when the exposure began.
    """

    flags: ImageFlag
    epoch: int
    frame: int
    number: int
    index: int
    count: int
    tuning_word: int
    phase: int
    harmonic: int
    exposure_ns: int
    device_time_ns: int
    temperature_c: float
    payload_bytes: int
    payload_crc: int

    def pack(self) -> bytes:
        """Return the 64 bytes, with their checksum."""
        body = _HEADER.pack(
            IMAGE_MAGIC,
            VERSION,
            IMAGE_HEADER_BYTES,
            self.flags,
            self.epoch,
            self.frame,
            self.number,
            self.index,
            self.count,
            self.tuning_word,
            self.phase,
            self.harmonic,
            self.exposure_ns,
            self.device_time_ns,
            _centidegrees(self.temperature_c),
            self.payload_bytes,
            self.payload_crc,
        )
        return body + _CRC.pack(crc32c(body))

    @classmethod
    def unpack(cls, data: bytes) -> "ImageHeader | None":
        """Read 64 bytes; None unless they are a header, of this version and undamaged."""
        if data[:4] != IMAGE_MAGIC or data[4] != VERSION or data[5] != IMAGE_HEADER_BYTES:
            return None
        if crc32c(data[: _HEADER.size]) != _CRC.unpack_from(data, _HEADER.size)[0]:
            return None
        fields = iter(_HEADER.unpack_from(data, 0)[3:])
        return cls(
            flags=ImageFlag(next(fields)),
            epoch=next(fields),
            frame=next(fields),
            number=next(fields),
            index=next(fields),
            count=next(fields),
            tuning_word=next(fields),
            phase=next(fields),
            harmonic=next(fields),
            exposure_ns=next(fields),
            device_time_ns=next(fields),
            temperature_c=next(fields) / 100,
            payload_bytes=next(fields),
            payload_crc=next(fields),
        )


def phase_word(phase_rad: float) -> int:
    """Phase in 1/65536 of a turn."""
    return round(phase_rad / (2 * math.pi) * 65536) % 65536


def payload_checksum(payload: bytes | bytearray | memoryview) -> int:
    """CRC-32C (Castagnoli) of an image's pixels."""
    return int(crc32c(payload))


def _nanoseconds(time_s: float) -> int:
    return round(time_s * 1e9)


def _centidegrees(temperature_c: float) -> int:
    return max(-32768, min(32767, round(temperature_c * 100)))


def _text(field: bytes) -> str:
    return field.rstrip(b"\0").decode("utf-8", "replace")


def _bits(names: tuple[str, ...], known: tuple[str, ...]) -> int:
    return sum(1 << known.index(name) for name in names)


def _named(bits: int, known: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for k, name in enumerate(known) if bits >> k & 1)
