"""The command protocol of a Kinect v2: requests and answers to the byte.

All numbers are little-endian. A request is answered by its data, where it has any, and then always
by a completion of 16 bytes. One request is under way at a time.

The layout and the numbers are those of OpenKinect/libfreenect2 @ fd64c5d,
``include/internal/libfreenect2/protocol/command.h`` (requests), ``response.h`` (answers) and
``src/command_transaction.cpp`` (order and checks); Microsoft has published none.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from transientcam_driver.errors import ProtocolError

REQUEST_MAGIC: Final = 0x06022009
COMPLETION_MAGIC: Final = 0x0A6FE000
COMPLETION_BYTES: Final = 16
LARGEST_ANSWER_BYTES: Final = 0x1C0000
"""What is asked for where the length of an answer may differ between firmwares."""
PARAMETERS_BYTES: Final = 92
P0_BYTES: Final = 1_302_572
COLOR_PARAMETERS_BYTES: Final = 12_981

_HEADER: Final = struct.Struct("<5I")
_COMPLETION: Final = struct.Struct("<2I8x")
_VERSION: Final = struct.Struct("<HHII4x")
_MAIN_VERSION: Final = 3  # of the table of firmwares


class Command(IntEnum):
    """What a request asks for."""

    READ_FIRMWARE_VERSIONS = 0x02
    INITIALISE_STREAMS = 0x09
    STOP = 0x0A
    READ_HARDWARE = 0x14
    READ_STATUS = 0x16
    READ_DATA = 0x22
    SET_STREAMING = 0x2B
    SET_MODE = 0x4B


@dataclass(frozen=True, slots=True)
class Request:
    """A request, and how long its answer may be."""

    command: Command
    parameters: tuple[int, ...] = ()
    """None, one or four numbers."""
    least_bytes: int = 0
    most_bytes: int = 0
    """``least_bytes``, ``most_bytes``: the shortest answer that counts, and the longest that is
    asked for; 0 for no answer."""

    def pack(self, sequence: int) -> bytes:
        """Return the bytes of the request with its sequence number."""
        header = (REQUEST_MAGIC, sequence, self.most_bytes, self.command, 0)
        return _HEADER.pack(*header) + struct.pack(f"<{len(self.parameters)}I", *self.parameters)

    @property
    def name(self) -> str:
        """The request in words, as ``READ_DATA 0x2``."""
        numbers = "".join(f" {number:#x}" for number in self.parameters)
        return f"{self.command.name}{numbers}"


READ_FIRMWARE_VERSIONS: Final = Request(Command.READ_FIRMWARE_VERSIONS, (), 0x200, 0x200)
READ_HARDWARE: Final = Request(Command.READ_HARDWARE, (), 0x5C, 0x5C)
READ_SERIAL: Final = Request(Command.READ_DATA, (1,), 0x80, 0x80)
READ_P0: Final = Request(Command.READ_DATA, (2,), P0_BYTES, LARGEST_ANSWER_BYTES)
READ_PARAMETERS: Final = Request(Command.READ_DATA, (3,), PARAMETERS_BYTES, LARGEST_ANSWER_BYTES)
READ_COLOR_PARAMETERS: Final = Request(
    Command.READ_DATA, (4,), COLOR_PARAMETERS_BYTES, LARGEST_ANSWER_BYTES
)
MODE_ON: Final = Request(Command.SET_MODE, (1, 0x00640064, 0, 0))
MODE_ON_PLAIN: Final = Request(Command.SET_MODE, (1, 0, 0, 0))
MODE_OFF: Final = Request(Command.SET_MODE, (0, 0, 0, 0))
READ_STATUS: Final = Request(Command.READ_STATUS, (0x090000,), 4, 4)
INITIALISE_STREAMS: Final = Request(Command.INITIALISE_STREAMS)
STREAMING_ON: Final = Request(Command.SET_STREAMING, (1,))
STREAMING_OFF: Final = Request(Command.SET_STREAMING, (0,))
STOP: Final = Request(Command.STOP)


def is_completion(data: bytes) -> bool:
    """Whether bytes are a completion: where an answer belongs, an error of the device."""
    return len(data) == COMPLETION_BYTES and data[:4] == COMPLETION_MAGIC.to_bytes(4, "little")


def completed_sequence(data: bytes, request: Request) -> int:
    """Return the sequence number that a completion is for.

    Raises ProtocolError where it is no completion.
    """
    if not is_completion(data):
        raise ProtocolError(f"{request.name} was not completed: {_shown(data)} came instead")
    _, sequence = _COMPLETION.unpack(data)
    return int(sequence)


def checked_answer(data: bytes, request: Request) -> bytes:
    """Return the answer to a request. Raises ProtocolError where it is too short."""
    if len(data) < request.least_bytes:
        size = f"{len(data)} bytes, at least {request.least_bytes} are needed"
        raise ProtocolError(f"the answer to {request.name} has {size}")
    return data


def firmware_version(answer: bytes) -> str:
    """Return the version of the main firmware, ``major.minor.revision.build``.

    The answer is a table of ``{u16 minor, u16 major, u32 revision, u32 build, u32 0}``.
    """
    minor, major, revision, build = _VERSION.unpack_from(answer, _MAIN_VERSION * _VERSION.size)
    return f"{major}.{minor}.{revision}.{build}"


def serial_number(answer: bytes) -> str:
    """Return the serial number: two bytes a character, up to the first that is zero.

    Raises ProtocolError where it is empty, or holds what cannot be printed.
    """
    text = answer[: len(answer) // 2 * 2].decode("utf-16-le", errors="replace").split("\0")[0]
    if not text or not text.isascii() or not text.isprintable():
        raise ProtocolError(f"the serial number is {text!r}")
    return text


def is_ready(answer: bytes) -> bool:
    """Whether the status says that streams can be initialised: its lowest bit."""
    return bool(answer[0] & 1)


def _shown(data: bytes) -> str:
    return f"{len(data)} bytes ({data[:8].hex(' ')} ...)" if data else "nothing"
