"""The bytes of a TOFcam660: commands, answers, image headers and packets.

Commands, answers and headers are big-endian, pixels little-endian. Layouts after the vendor's
client (epc-tofcam-toolkit 0.13.0, `epc/tofCam660`); no code is shared.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from transientcam_driver.errors import DeviceRefused, ProtocolError

CONTROL_PORT: Final = 50660
DATA_PORT: Final = 45454
DEFAULT_ADDRESS: Final = "10.10.31.180"
START, END = 0xFFFFAA55, 0xFFFF55AA
REQUEST_BYTES: Final = 34
LONGEST_ANSWER_BYTES: Final = 4096
DLL_REGISTERS: Final = (0x71, 0x72, 0x73, 0x8B, 0x93)
"""Those of the delay line, which presets use; free frequencies want them zero."""
CODES_FROM: Final = 64000
"""From here on a value is no measurement, but says why there is none."""
LOW_AMPLITUDE, OVERFLOW, SATURATED = 64001, 64002, 64003

_HEAD: Final = struct.Struct("!II")
_TAIL: Final = struct.Struct("!I")
HEAD_BYTES: Final = _HEAD.size
TAIL_BYTES: Final = _TAIL.size


class Command(IntEnum):
    """First two bytes of a request."""

    SET_ROI = 0
    SET_INTEGRATION_TIMES = 1
    GET_DISTANCE_AND_AMPLITUDE = 2
    GET_DISTANCE = 3
    GET_GRAYSCALE = 5
    STOP_STREAM = 6
    GET_DCS = 7
    SET_MINIMUM_AMPLITUDE = 21
    SET_FILTER = 22
    SET_MODULATION_FREQUENCY = 23
    SET_BINNING = 24
    SET_HDR = 25
    READ_CHIP = 36
    READ_FIRMWARE = 37
    SET_DATA_ADDRESS = 38
    WRITE_REGISTER = 42
    READ_REGISTER = 43
    SET_FREE_FREQUENCY = 52
    READ_CALIBRATION = 53
    READ_INTEGRATION_TIMES = 56
    SET_DATA_PROTOCOL = 57
    READ_DATA_PROTOCOL = 58
    READ_TEMPERATURE = 74


class AnswerType(IntEnum):
    """First byte of an answer."""

    ACKNOWLEDGE = 0
    ERROR = 1
    FIRMWARE = 2
    CHIP = 3
    TEMPERATURE = 4
    REGISTER = 6
    CALIBRATION = 9
    INTEGRATION_TIMES = 10
    DATA_PROTOCOL = 11
    CALIBRATING = 254
    NOT_ACKNOWLEDGED = 255


class ImageType(IntEnum):
    """What an image holds for each pixel."""

    DISTANCE_AND_AMPLITUDE = 0
    DISTANCE = 1
    GRAYSCALE = 3
    DCS = 4

    @property
    def values_per_pixel(self) -> int:
        """How many numbers of two bytes."""
        return {ImageType.DISTANCE_AND_AMPLITUDE: 2, ImageType.DCS: 4}.get(self, 1)


def pack_request(command: int, data: bytes = b"") -> bytes:
    """Return a request with its markers."""
    payload = struct.pack("!H", command) + data
    return _framed(payload.ljust(REQUEST_BYTES, b"\0"))


def pack_answer(kind: AnswerType, data: bytes = b"") -> bytes:
    """Return an answer with its markers."""
    return _framed(bytes([kind]) + data)


def _framed(payload: bytes) -> bytes:
    return _HEAD.pack(START, len(payload)) + payload + _TAIL.pack(END)


def payload_bytes(head: bytes) -> int:
    """Return the length of the payload behind the first 8 bytes.

    Raises ProtocolError where there is no start marker, or the length is none that an answer has.
    """
    start, size = _HEAD.unpack(head)
    if start != START:
        raise ProtocolError(f"{start:#010x} in place of the start marker {START:#010x}")
    if not 1 <= size <= LONGEST_ANSWER_BYTES:
        raise ProtocolError(f"a payload of {size} bytes, 1 to {LONGEST_ANSWER_BYTES} expected")
    return int(size)


def require_end(tail: bytes) -> None:
    """Check the last 4 bytes. Raises ProtocolError where they are not the end marker."""
    (end,) = _TAIL.unpack(tail)
    if end != END:
        raise ProtocolError(f"{end:#010x} in place of the end marker {END:#010x}")


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer without its markers."""

    kind: int
    data: bytes

    @classmethod
    def of(cls, payload: bytes, command: Command) -> "Answer":
        """Read a payload.

        Raises DeviceRefused where the camera did not do what the command says.
        """
        kind, data = payload[0], bytes(payload[1:])
        if kind == AnswerType.NOT_ACKNOWLEDGED:
            raise DeviceRefused(command.name, "NOT_ACKNOWLEDGED", "not acknowledged")
        if kind == AnswerType.CALIBRATING:
            raise DeviceRefused(command.name, "CALIBRATING", "it is calibrating itself")
        if kind == AnswerType.ERROR:
            number = int.from_bytes(data[:2], "big")
            raise DeviceRefused(command.name, f"ERROR_{number}", f"error {number}")
        return cls(kind, data)

    def fields(self, kind: AnswerType, layout: str) -> tuple[int, ...]:
        """Return the numbers of an answer of this type.

        Raises ProtocolError where it is an answer of another type or length.
        """
        expected = struct.calcsize(layout)
        if self.kind != kind or len(self.data) != expected:
            raise ProtocolError(
                f"an answer of type {self.kind} with {len(self.data)} bytes, "
                f"type {kind.value} with {expected} expected"
            )
        return struct.unpack(layout, self.data)


@dataclass(frozen=True, slots=True)
class CalibrationEntry:
    """What the factory measured at one of the preset frequencies."""

    frequency_code: int
    temperature_c: float
    atan_offset_mm: int


_ENTRY: Final = struct.Struct("!BHH")


def pack_calibration(entries: tuple[CalibrationEntry, ...]) -> bytes:
    """Return the data of an answer to READ_CALIBRATION."""
    return b"".join(
        _ENTRY.pack(each.frequency_code, round(each.temperature_c * 1e3), each.atan_offset_mm)
        for each in entries
    )


def unpack_calibration(answer: Answer) -> tuple[CalibrationEntry, ...]:
    """Read the answer to READ_CALIBRATION.

    Raises ProtocolError where it holds no whole number of entries.
    """
    if answer.kind != AnswerType.CALIBRATION or len(answer.data) % _ENTRY.size:
        raise ProtocolError(f"calibration data of {len(answer.data)} bytes, type {answer.kind}")
    return tuple(
        CalibrationEntry(code, millidegrees / 1e3, offset_mm)
        for code, millidegrees, offset_mm in _ENTRY.iter_unpack(answer.data)
    )
