"""Requests and answers of the command protocol, to the byte."""

import pytest

from transientcam_driver import ProtocolError
from transientcam_driver.cameras.kinect2 import Request, _commands as commands

# by hand from OpenKinect/libfreenect2 @ fd64c5d, include/internal/libfreenect2/protocol/command.h:
# magic, sequence, longest answer, command, 0, parameters
BYTES = {
    commands.READ_FIRMWARE_VERSIONS: "09200206 07000000 00020000 02000000 00000000",
    commands.READ_HARDWARE: "09200206 07000000 5c000000 14000000 00000000",
    commands.READ_SERIAL: "09200206 07000000 80000000 22000000 00000000 01000000",
    commands.READ_P0: "09200206 07000000 00001c00 22000000 00000000 02000000",
    commands.READ_PARAMETERS: "09200206 07000000 00001c00 22000000 00000000 03000000",
    commands.READ_COLOR_PARAMETERS: "09200206 07000000 00001c00 22000000 00000000 04000000",
    commands.MODE_ON: "09200206 07000000 00000000 4b000000 00000000 01000000 64006400"
    " 00000000 00000000",
    commands.MODE_ON_PLAIN: "09200206 07000000 00000000 4b000000 00000000 01000000 00000000"
    " 00000000 00000000",
    commands.MODE_OFF: "09200206 07000000 00000000 4b000000 00000000 00000000 00000000"
    " 00000000 00000000",
    commands.READ_STATUS: "09200206 07000000 04000000 16000000 00000000 00000900",
    commands.INITIALISE_STREAMS: "09200206 07000000 00000000 09000000 00000000",
    commands.STREAMING_ON: "09200206 07000000 00000000 2b000000 00000000 01000000",
    commands.STREAMING_OFF: "09200206 07000000 00000000 2b000000 00000000 00000000",
    commands.STOP: "09200206 07000000 00000000 0a000000 00000000",
}


@pytest.mark.parametrize("request_", BYTES, ids=lambda each: each.name)
def test_a_request_has_these_bytes(request_: Request) -> None:
    assert request_.pack(7) == bytes.fromhex(BYTES[request_])


def test_the_version_is_that_of_the_fourth_firmware() -> None:
    others = bytes.fromhex("0100 0200 03000000 04000000 00000000")
    main = bytes.fromhex("0300 0200 490f0000 07000000 00000000")

    assert commands.firmware_version((3 * others + main).ljust(0x200, b"\0")) == "2.3.3913.7"


def test_a_serial_number_ends_at_its_first_zero() -> None:
    answer = bytes.fromhex("3000 3400 3100 0000 4100").ljust(0x80, b"\0")

    assert commands.serial_number(answer) == "041"


@pytest.mark.parametrize("answer", [b"", b"\0" * 0x80, b"\n\0" * 4, b"\xe9\0" * 4])
def test_a_serial_number_that_is_none_is_refused(answer: bytes) -> None:
    with pytest.raises(ProtocolError, match="serial number"):
        commands.serial_number(answer)


def test_a_completion_names_its_request() -> None:
    completion = bytes.fromhex("00e06f0a 2a000000 deadbeef deadbeef")

    assert commands.completed_sequence(completion, commands.STOP) == 42
    assert commands.is_completion(completion)


@pytest.mark.parametrize(
    "data", [b"", b"\0" * 16, bytes.fromhex("00e06f0a 2a000000"), b"\0" * 92], ids=len
)
def test_what_comes_in_place_of_a_completion_is_shown(data: bytes) -> None:
    with pytest.raises(ProtocolError, match=f"STOP was not completed: .*{len(data) or 'nothing'}"):
        commands.completed_sequence(data, commands.STOP)


def test_an_answer_that_is_too_short_is_refused_with_both_lengths() -> None:
    assert commands.checked_answer(bytes(92), commands.READ_PARAMETERS) == bytes(92)
    with pytest.raises(ProtocolError, match=r"READ_DATA 0x3 has 91 bytes, at least 92"):
        commands.checked_answer(bytes(91), commands.READ_PARAMETERS)


@pytest.mark.parametrize(("answer", "ready"), [(b"\0\0\0\0", False), (b"\3\0\0\0", True)])
def test_the_lowest_bit_of_the_status_is_ready(answer: bytes, ready: bool) -> None:
    assert commands.is_ready(answer) is ready
