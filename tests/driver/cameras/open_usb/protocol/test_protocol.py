"""Bytes against docs/usb-protocol.md: offsets written out by hand, and recorded vectors."""

import math
import re
import struct
from dataclasses import replace
from enum import IntEnum, IntFlag
from typing import Any

import pytest
from hypothesis import given, strategies as st

from tests.conftest import ROOT
from transientcam_driver import FirmwareTooOld, ProtocolError, Sequence, SubPhases
from transientcam_driver.camera import DeviceState, Status, StatusFlag
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
    unpack_capabilities,
    unpack_last_error,
    unpack_status,
    unpack_time,
)
from transientcam_driver.cameras.open_usb.protocol._capabilities import CAPS_BYTES, CAPS_ROOM_BYTES
from transientcam_driver.cameras.open_usb.protocol._requests import (
    IMAGE_ENDPOINT,
    PRODUCT_ID,
    VENDOR_CLASS,
    VENDOR_ID,
)
from transientcam_simulation.emulated._open_usb.prototype import prototype

SPECIFICATION = ROOT / "docs" / "usb-protocol.md"
CAPABILITIES = prototype(serial="T-1", width=163, height=120, bits=12)

u8, u16, u32, u64 = (st.integers(0, 2**bits - 1) for bits in (8, 16, 32, 64))


def naive_crc(data: bytes) -> int:
    """CRC-32C bit by bit."""
    register = 0xFFFFFFFF
    for byte in data:
        register ^= byte
        for _bit in range(8):
            register = register >> 1 ^ (0x82F63B78 if register & 1 else 0)
    return register ^ 0xFFFFFFFF


def number(data: bytes, offset: int, size: int) -> int:
    return int.from_bytes(data[offset : offset + size], "little")


HEADER = ImageHeader(
    flags=ImageFlag.ILLUMINATION | ImageFlag.FIRST_OF_FRAME,
    epoch=3,
    frame=17,
    number=0x1_0000_0002,
    index=4,
    count=16,
    tuning_word=92_000_000,
    phase=49152,
    harmonic=1,
    exposure_ns=1_920_000,
    device_time_ns=123_456_789_012,
    temperature_c=-1.25,
    payload_bytes=39120,
    payload_crc=0xE3069283,
)

# Recorded once and checked by hand against section 8.
HEADER_VECTOR = bytes.fromhex(
    "5443494d 01 40 0300 03000000 11000000 0200000001000000 0400 1000 00cf7b05 00c0 0100"
    "004c1d00 141a99be1c000000 83ff 0000 d0980000 839206e3"
)


STATED = {
    Request: r"^\| (0x\w\w) \| ([A-Z_]+) \| (?:in|out) \|",
    ErrorCode: r"^\| (\d) \| ([A-Z_]+) \|",
    DeviceState: r"^\| 1 \| uint8 \| (state: 0 .*) \|$",
    StatusFlag: r"^\| 2 \| uint16 \| (flags: .*) \|$",
    ImageFlag: r"^\| 6 \| uint16 \| (flags: .*) \|$",
}
"""Where the specification has the codes: in rows of a table, or all in one."""


@pytest.mark.parametrize("codes", STATED)
def test_codes_are_those_of_the_specification(codes: type[IntEnum] | type[IntFlag]) -> None:
    found = re.findall(STATED[codes], SPECIFICATION.read_text("utf-8"), re.MULTILINE)
    if len(found) == 1:
        found = re.findall(r"(\d) ([A-Z_]{3,})", found[0])

    assert {int(code, 0): name for code, name in found} == {int(each): each.name for each in codes}


def test_the_device_is_found_by_what_the_specification_states() -> None:
    text = SPECIFICATION.read_text("utf-8")

    assert f"| vendor : product | {VENDOR_ID:04x} : {PRODUCT_ID:04x}, a test number" in text
    assert f"| class | vendor specific (0x{VENDOR_CLASS:02X}), one configuration" in text
    assert f"| endpoint | 0x{IMAGE_ENDPOINT:02x}, bulk IN: images |" in text
    assert f"capabilities (section 4); ask for {CAPS_ROOM_BYTES} bytes" in text


def test_the_checksum_is_the_castagnoli_one() -> None:
    assert payload_checksum(b"123456789") == naive_crc(b"123456789") == 0xE3069283


def test_an_image_header_has_the_bytes_of_the_specification() -> None:
    packed = HEADER.pack()

    assert packed[:60] == HEADER_VECTOR
    assert number(packed, 60, 4) == naive_crc(HEADER_VECTOR)
    assert len(packed) == 64


def test_a_recorded_image_header_is_read() -> None:
    recorded = HEADER_VECTOR + struct.pack("<I", naive_crc(HEADER_VECTOR))

    assert ImageHeader.unpack(recorded) == HEADER


headers = st.builds(
    ImageHeader,
    flags=st.integers(0, 15).map(ImageFlag),
    epoch=u32,
    frame=u32,
    number=u64,
    index=u16,
    count=u16,
    tuning_word=u32,
    phase=u16,
    harmonic=u16,
    exposure_ns=u32,
    device_time_ns=u64,
    temperature_c=st.integers(-32768, 32767).map(lambda centi: centi / 100),
    payload_bytes=u32,
    payload_crc=u32,
)


@given(header=headers)
def test_an_image_header_read_back_is_the_same(header: ImageHeader) -> None:
    assert ImageHeader.unpack(header.pack()) == header


@given(header=headers, bit=st.integers(0, 64 * 8 - 1))
def test_a_header_with_any_bit_flipped_is_none(header: ImageHeader, bit: int) -> None:
    damaged = bytearray(header.pack())
    damaged[bit // 8] ^= 1 << bit % 8

    assert ImageHeader.unpack(bytes(damaged)) is None


@pytest.mark.parametrize(
    ("offset", "values"), [(0, b"SU"), (3, b"LN"), (4, b"\x00\x02\xff"), (5, b"\x3f\x41\x00\xff")]
)
def test_another_mark_version_or_length_is_no_header_though_its_checksum_holds(
    offset: int, values: bytes
) -> None:
    for value in values:
        body = bytearray(HEADER.pack()[:60])
        body[offset] = value

        assert ImageHeader.unpack(bytes(body) + struct.pack("<I", naive_crc(bytes(body)))) is None


def test_capabilities_have_the_fields_at_the_offsets_of_the_specification() -> None:
    packed = pack_capabilities(CAPABILITIES)

    assert len(packed) == CAPS_BYTES == 152
    assert packed[:4] == b"TCCP"
    assert [number(packed, offset, 2) for offset in (4, 6)] == [1, 152]
    assert packed[40:72].rstrip(b"\0") == b"T-1"
    assert [number(packed, offset, 2) for offset in (88, 90)] == [163, 120]
    assert list(packed[92:98]) == [12, 32, 32, 0b111, 0b111, 0b1]
    assert [number(packed, offset, 2) for offset in (98, 100, 102)] == [256, 2048, 1]
    assert [number(packed, offset, 4) for offset in range(104, 148, 4)] == [
        250_000,
        2_000_000,
        600_000_000,
        3_600_000,
        20_000,
        50_000_000,
        3_730_000,
        3_980_000,
        32 * (64 + 39120),
        2000,
        0,
    ]
    assert number(packed, 148, 4) == naive_crc(packed[:148])


def test_capabilities_read_back_are_the_same() -> None:
    assert unpack_capabilities(pack_capabilities(CAPABILITIES)) == CAPABILITIES


def test_capabilities_with_fields_appended_by_a_later_firmware_are_read() -> None:
    longer = bytearray(pack_capabilities(CAPABILITIES)[:-4] + b"new field")
    struct.pack_into("<H", longer, 6, len(longer) + 4)
    longer += struct.pack("<I", naive_crc(bytes(longer)))

    assert unpack_capabilities(bytes(longer)) == CAPABILITIES


@pytest.mark.parametrize("version", [0, 2, 65535])
def test_another_protocol_version_requires_new_firmware(version: int) -> None:
    other = pack_capabilities(replace(CAPABILITIES, protocol_version=version))

    with pytest.raises(FirmwareTooOld, match=f"version {version} found, version 1 needed"):
        unpack_capabilities(other)


@pytest.mark.parametrize("mark", [b"TCCO", b"TCCQ", b"SCCP", b"UCCP"])
def test_what_has_another_mark_is_no_capabilities(mark: bytes) -> None:
    with pytest.raises(ProtocolError, match="152 bytes without the mark"):
        unpack_capabilities(mark + pack_capabilities(CAPABILITIES)[4:])


@given(bit=st.integers(8 * 8, CAPS_BYTES * 8 - 1))
def test_damaged_capabilities_are_refused(bit: int) -> None:
    damaged = bytearray(pack_capabilities(CAPABILITIES))
    damaged[bit // 8] ^= 1 << bit % 8

    with pytest.raises(ProtocolError, match="checksum"):
        unpack_capabilities(bytes(damaged))


@given(data=st.binary(max_size=200))
def test_whatever_is_not_capabilities_is_a_protocol_error(data: bytes) -> None:
    with pytest.raises(ProtocolError):
        unpack_capabilities(data)


@pytest.mark.parametrize(
    ("field", "within", "beyond", "name"),
    [
        ("width", [1, 4096], [0, 4097], "width"),
        ("height", [1, 4096], [0, 4097], "height"),
        ("bits", [1, 16], [0, 17], "bits"),
        ("max_harmonics", [1, 255], [0], "harmonics"),
        ("max_sub_phases", [1, 255], [0], "sub-phases"),
        ("max_takes", [1, 65535], [0], "takes"),
        ("max_images", [1, 65535], [0], "images"),
        ("min_frequency_hz", [1.0, 150e6], [0.0, 0.75, 150e6 + 0.25], "lowest frequency"),
        ("min_exposure_s", [1e-9, 0.05], [0.0, 0.050000001], "shortest exposure"),
        ("heartbeat_s", [0.01, 3600.0], [0.009, 3600.001], "heartbeat"),
        ("fifo_bytes", [64 + 39120, 2**32 - 1], [64 + 39119], "FIFO"),
        ("schemes", [("arccos",)], [()], "schemes"),
        ("zeroths", [("on-off",), ("estimated",)], [()], "zeroth moment"),
    ],
)
def test_capabilities_are_taken_up_to_their_limits(
    field: str, within: list[Any], beyond: list[Any], name: str
) -> None:
    wide = replace(CAPABILITIES, fifo_bytes=2**28) if field in {"width", "height"} else CAPABILITIES
    for value in within:
        at_limit = replace(wide, **{field: value})
        assert getattr(unpack_capabilities(pack_capabilities(at_limit)), field) == value
    for value in beyond:
        liar = replace(wide, **{field: value})
        with pytest.raises(ProtocolError, match=name):
            unpack_capabilities(pack_capabilities(liar))


@pytest.mark.parametrize("step_hz", [1e-6, 0.25, 1000.0, (2**32 - 1) / 1e6])
def test_steps_of_a_synthesiser_are_in_millionths_of_a_hertz(step_hz: float) -> None:
    stated = replace(
        CAPABILITIES,
        tuning_step_hz=step_hz,
        min_frequency_hz=max(1.0, step_hz),
        max_frequency_hz=1000 * max(1.0, step_hz),
        low_frequency_hz=0.0,
    )

    assert number(pack_capabilities(stated), 104, 4) == round(step_hz * 10**6)
    assert unpack_capabilities(pack_capabilities(stated)) == stated


def test_a_synthesiser_has_steps_of_a_millionth_of_a_hertz_or_more() -> None:
    finest = replace(
        CAPABILITIES,
        tuning_step_hz=1e-6,
        min_frequency_hz=1.0,
        max_frequency_hz=4000.0,
        low_frequency_hz=0.0,
    )

    packed = pack_capabilities(finest)
    without = packed[:104] + bytes(4) + packed[108:-4]

    assert unpack_capabilities(packed).tuning_step_hz == 1e-6
    with pytest.raises(ProtocolError, match="tuning step"):
        unpack_capabilities(without + struct.pack("<I", naive_crc(without)))


@pytest.mark.parametrize("kept", range(CAPS_BYTES))
def test_capabilities_cut_short_are_refused(kept: int) -> None:
    whole = pack_capabilities(CAPABILITIES)
    named = "mark" if kept < 8 else f"of {kept} bytes, {CAPS_BYTES} needed"

    with pytest.raises(ProtocolError, match=named):
        unpack_capabilities(whole[:kept])


def test_capabilities_that_state_to_be_shorter_than_their_fields_are_refused() -> None:
    short = bytearray(pack_capabilities(CAPABILITIES))
    struct.pack_into("<H", short, 6, CAPS_BYTES - 1)

    with pytest.raises(ProtocolError, match=f"{CAPS_BYTES} needed"):
        unpack_capabilities(bytes(short))


def test_a_sequence_has_the_bytes_of_the_specification() -> None:
    sequence = Sequence(23e6, 4, exposure_s=1.92e-3, takes=20)

    packed = SequenceWords.of(sequence, CAPABILITIES).pack()

    assert packed == bytes.fromhex("01 04 01 01 08 00 1400 00cf7b05 80ee3600 004c1d00")


def test_interleaved_takes_are_one_byte_of_a_sequence() -> None:
    sequence = Sequence(23e6, 4, exposure_s=1.92e-3, takes=20, take_order="interleaved")

    packed = SequenceWords.of(sequence, CAPABILITIES).pack()

    assert packed == bytes.fromhex("01 04 01 01 08 01 1400 00cf7b05 80ee3600 004c1d00")


@pytest.mark.parametrize(
    ("zeroth", "low_word"), [("low-frequency", 3_600_000), ("on-off", 0), ("estimated", 0)]
)
def test_only_a_zeroth_moment_at_a_low_frequency_has_one(zeroth: Any, low_word: int) -> None:
    words = SequenceWords.of(Sequence(23e6, 4, zeroth), CAPABILITIES)

    assert (words.low_word, words.word(0)) == (low_word, low_word)
    assert number(words.pack(), 12, 4) == low_word
    assert words.word(3) == 3 * 92_000_000


def test_a_phase_offset_is_appended_to_a_sequence() -> None:
    sequence = Sequence(23e6, 4, exposure_s=1.92e-3, takes=20, phase_offset_rad=math.pi / 16)

    words = SequenceWords.of(sequence, CAPABILITIES)
    commitment = Commitment(5, 16, 2**40, 5_900_000, words)

    packed = "01 04 01 01 08 00 1400 00cf7b05 80ee3600 004c1d00 0008 0000"  # 2048 / 65536 = 1 / 32
    assert words.pack() == bytes.fromhex(packed)
    assert SequenceWords.unpack(words.pack()).sequence(CAPABILITIES) == sequence
    assert len(commitment.pack()) == 44
    assert Commitment.unpack(commitment.pack()) == commitment


def test_a_camera_that_can_shift_phases_says_so_in_one_bit() -> None:
    packed = pack_capabilities(replace(CAPABILITIES, phase_offsets=False))

    assert (packed[102], packed[103]) == (0, 0)
    assert not unpack_capabilities(packed).phase_offsets


def test_a_camera_that_says_nothing_of_the_order_of_takes_has_the_sequential_one() -> None:
    silent = bytearray(pack_capabilities(CAPABILITIES)[:-4])
    silent[97] = 0
    packed = bytes(silent) + struct.pack("<I", naive_crc(bytes(silent)))

    assert unpack_capabilities(packed).take_orders == ("sequential",)


@given(
    base_frequency_hz=st.floats(0.5e6, 4.5e6),
    harmonics=st.integers(1, 32),
    zeroth=st.sampled_from(["low-frequency", "on-off", "estimated"]),
    exposure_s=st.floats(20e-6, 50e-3),
    takes=st.integers(1, 256),
    scheme=st.sampled_from(["arccos", "harmonic-cancellation", "none"]),
    n=st.integers(1, 32),
    take_order=st.sampled_from(["sequential", "interleaved"]),
)
def test_a_sequence_on_the_grid_survives_the_wire(
    base_frequency_hz: float,
    harmonics: int,
    zeroth: str,
    exposure_s: float,
    takes: int,
    scheme: str,
    n: int,
    take_order: str,
) -> None:
    requested = Sequence.from_document(
        {
            "base_frequency_hz": round(base_frequency_hz * 4) / 4,
            "harmonics": harmonics,
            "zeroth": zeroth,
            "exposure_s": round(exposure_s * 1e9) / 1e9,
            "takes": takes,
            "take_order": take_order,
            "sub_phases": {"scheme": scheme, "n": n},
        }
    )

    words = SequenceWords.unpack(SequenceWords.of(requested, CAPABILITIES).pack())

    assert words.sequence(CAPABILITIES) == requested
    assert [words.word(j) for j in range(1, harmonics + 1)] == [
        j * words.base_word for j in range(1, harmonics + 1)
    ]


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ({"zeroth": 3}, "code 3 for the zeroth moment"),
        ({"zeroth": 255}, "code 255 for the zeroth moment"),
        ({"scheme": 4}, "code 4 for the scheme"),
        ({"take_order": 3}, "code 3 for the order of takes"),
        ({"scheme": 3}, "code 3 for the scheme"),
        ({"take_order": 2}, "code 2 for the order of takes"),
    ],
)
def test_a_code_without_meaning_is_a_protocol_error(code: dict[str, int], name: str) -> None:
    words = replace(SequenceWords.of(Sequence(), CAPABILITIES), **code)

    with pytest.raises(ProtocolError, match=name):
        words.sequence(CAPABILITIES)


def test_a_commitment_read_back_is_the_same() -> None:
    words = SequenceWords.of(Sequence(sub_phases=SubPhases("none")), CAPABILITIES)
    commitment = Commitment(5, 16, 2**40, 5_900_000, words)

    packed = commitment.pack()

    assert len(packed) == 40
    assert [number(packed, 0, 4), number(packed, 4, 4), number(packed, 8, 8)] == [5, 16, 2**40]
    assert Commitment.unpack(packed) == commitment


def test_a_status_has_the_fields_at_the_offsets_of_the_specification() -> None:
    status = Status(
        DeviceState.STREAMING,
        StatusFlag.LIGHT_ON | StatusFlag.INTERLOCK_CLOSED,
        epoch=9,
        next_image=2**33,
        device_time_s=1.5,
        dropped_images=7,
        fifo_bytes=100,
        fifo_high_water_bytes=200,
        temperature_c=41.37,
    )

    packed = pack_status(status)

    assert packed == bytes.fromhex(
        "01 01 0300 09000000 0000000002000000 002f685900000000 07000000 64000000 c8000000 2910 0000"
    )
    assert unpack_status(packed) == status
    assert status.light_on
    assert status.interlock_closed
    assert not status.watchdog_tripped


@given(data=st.binary(max_size=64))
def test_answers_of_the_wrong_length_are_protocol_errors(data: bytes) -> None:
    for unpack, sizes in (
        (unpack_status, (40,)),
        (Commitment.unpack, (40, 44)),
        (SequenceWords.unpack, (20, 24)),
        (unpack_time, (8,)),
    ):
        if len(data) not in sizes:
            for each in (data, b"\1" + data[1:]):  # of the right version, too
                with pytest.raises(ProtocolError):
                    unpack(each)


@pytest.mark.parametrize("version", [0, 2, 255])
@pytest.mark.parametrize("size", [20, 24])
def test_a_sequence_or_status_of_another_version_is_a_protocol_error(
    version: int, size: int
) -> None:
    words = SequenceWords.of(Sequence(), CAPABILITIES).pack().ljust(size, b"\0")
    assert SequenceWords.unpack(words).phase_offset == 0

    with pytest.raises(ProtocolError, match=f"{size} bytes for a sequence"):
        SequenceWords.unpack(bytes([version]) + words[1:])
    with pytest.raises(ProtocolError, match="status of 40 bytes"):
        unpack_status(bytes([version]) + bytes(39))


@pytest.mark.parametrize("state", [len(DeviceState), 9, 255])
def test_an_unknown_state_is_a_protocol_error(state: int) -> None:
    with pytest.raises(ProtocolError, match=f"state {state}"):
        unpack_status(bytes([1, state]) + bytes(38))


def test_every_state_and_flag_is_read() -> None:
    for state in DeviceState:
        assert unpack_status(bytes([1, state]) + bytes(38)).state is state
    for flag in StatusFlag:
        status = unpack_status(bytes([1, 0]) + struct.pack("<H", flag) + bytes(36))
        assert status.flags == flag


@pytest.mark.parametrize(
    ("temperature_c", "centidegrees"),
    [
        (0.0, 0),
        (-0.01, -1),
        (25.004, 2500),
        (25.006, 2501),
        (327.67, 32767),
        (327.66, 32766),
        (327.68, 32767),
        (1e9, 32767),
        (-327.68, -32768),
        (-327.67, -32767),
        (-327.69, -32768),
        (-1e9, -32768),
    ],
)
def test_a_temperature_is_in_hundredths_within_16_bits(
    temperature_c: float, centidegrees: int
) -> None:
    packed = replace(HEADER, temperature_c=temperature_c).pack()

    assert int.from_bytes(packed[48:50], "little", signed=True) == centidegrees
    found = ImageHeader.unpack(packed)
    assert found is not None
    assert found.temperature_c == centidegrees / 100


@pytest.mark.parametrize(
    ("turns", "word"),
    [
        (0.0, 0),
        (1 / 65536, 1),
        (0.49 / 65536, 0),
        (0.51 / 65536, 1),
        (-1 / 65536, 65535),
        (1.25, 16384),
        (-0.25, 49152),
        (65535.4 / 65536, 65535),
        (65535.6 / 65536, 0),
    ],
)
def test_a_phase_is_in_parts_of_a_turn_and_wraps(turns: float, word: int) -> None:
    assert phase_word(turns * 2 * math.pi) == word
    words = replace(SequenceWords.of(Sequence(), CAPABILITIES), phase_offset=word)
    offset_rad = words.sequence(CAPABILITIES).phase_offset_rad
    assert offset_rad == pytest.approx(2 * math.pi * word / 65536, rel=1e-15)


def test_time_is_in_nanoseconds() -> None:
    assert pack_time(1e-9 * 0x0102030405) == bytes.fromhex("0504030201000000")
    assert unpack_time(pack_time(12.5)) == 12.5


def test_a_last_error_names_request_code_and_reason() -> None:
    packed = pack_last_error(ErrorCode.BAD_VALUE, Request.SET_SEQUENCE, "takes = 0")

    assert packed == b"\x03\x00\x02takes = 0"
    assert unpack_last_error(packed) == ("SET_SEQUENCE", "BAD_VALUE", "takes = 0")


def test_a_last_error_of_a_later_firmware_is_still_read() -> None:
    assert unpack_last_error(b"\x63\x00\x7fwhat") == ("request 0x7f", "error 99", "what")


@pytest.mark.parametrize("data", [b"", b"\x03", b"\x03\x00"])
def test_a_last_error_without_its_codes_is_a_protocol_error(data: bytes) -> None:
    with pytest.raises(ProtocolError, match=f"last error of {len(data)} bytes"):
        unpack_last_error(data)
    assert unpack_last_error(b"\x00\x00\x01") == ("GET_CAPS", "NONE", "")


def test_a_last_error_fits_into_one_packet() -> None:
    assert len(pack_last_error(ErrorCode.BAD_VALUE, 2, "x" * 500)) == 64


@pytest.mark.parametrize(
    ("quarter_turns", "word"), [(0, 0), (1, 16384), (2, 32768), (3, 49152), (4, 0)]
)
def test_quarter_turns_are_exact_phase_words(quarter_turns: int, word: int) -> None:
    assert phase_word(quarter_turns * 1.5707963267948966) == word
