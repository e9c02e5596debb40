"""The bytes of a TOFcam660, held to the recorded session and to what must be refused."""

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.driver.cameras.tofcam660.session import frames, steps
from transientcam_driver import DeviceRefused, ImagesLost, ProtocolError
from transientcam_driver.cameras.tofcam660 import (
    AnswerType,
    CalibrationEntry,
    Command,
    ImageHeader,
    PacketHeader,
    Region,
    offset_m,
    payload_bytes,
    require_end,
)
from transientcam_driver.cameras.tofcam660._image import HEADER_BYTES, dcs_images
from transientcam_driver.cameras.tofcam660._wire import Answer, pack_request, unpack_calibration
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S

ROI = Region(100, 90, 180, 150)
ENTRIES = (CalibrationEntry(1, 39.0, 8123),)


def test_every_recorded_request_is_packed_byte_for_byte(data_dir: Path) -> None:
    recorded = list(steps(data_dir))

    assert len(recorded) == 178
    for step in recorded:
        data = step.payload[2:].rstrip(b"\0")
        assert pack_request(step.command, data) == step.request


def test_every_recorded_answer_is_read(data_dir: Path) -> None:
    refused = []
    for step in steps(data_dir):
        size = payload_bytes(step.response[:8])
        require_end(step.response[-4:])
        payload = step.response[8:-4]
        assert len(payload) == size
        try:
            Answer.of(payload, Command.GET_DCS)
        except DeviceRefused as refusal:
            refused.append((step.name, refusal.code))

    assert refused == [("setFlexModFreq", "NOT_ACKNOWLEDGED")]


def test_recorded_headers_are_read_and_packed_again(data_dir: Path) -> None:
    images = [step.image for step in steps(data_dir) if step.image]

    for image in images:
        header = ImageHeader.unpack(bytes.fromhex(image["header"]))
        fields = image["header_fields"]
        assert header.pack().hex() == image["header"]
        assert (header.kind, header.columns, header.rows) == (
            fields["measurement_type"],
            fields["columns"],
            fields["rows"],
        )
        assert header.temperature_c == fields["temperature_centidegrees"] / 100
        for name in ("udp_header_first", "udp_header_last"):
            if name in image:
                packet = PacketHeader.unpack(bytes.fromhex(image[name]))
                assert packet.pack().hex() == image[name]
                assert (packet.image_bytes, packet.packets) == (image["bytes"], image["packets"])
    assert len(images) > 10


@pytest.mark.parametrize("megahertz", ["7", "14", "21", "28", "3.5", "0.25"])
def test_differences_give_the_vendors_distance_and_amplitude(
    data_dir: Path, megahertz: str
) -> None:
    stored = frames(data_dir)
    wire = stored[f"flex_{megahertz}MHz_dcs_wire_u16"]
    header = ImageHeader(4, 80, 60, ROI, (300, 0, 0), 41.25)

    images = dcs_images(header.pack() + wire.astype("<u2").tobytes(), ROI, 300).astype(float)

    corrupt = (wire >= 64000).any(axis=0)
    assert np.array_equal((images == 4095).any(axis=0), corrupt)
    phasor = images[0] - images[2] + 1j * (images[1] - images[3])
    period_m = SPEED_OF_LIGHT_M_S / (2 * float(megahertz) * 1e6)
    measured_m = np.angle(phasor) / (2 * np.pi) * period_m
    distance_m = (measured_m - offset_m(ENTRIES, 41.25)) % period_m
    theirs_m = stored[f"flex_{megahertz}MHz_vendor_distance_mm"] / 1e3
    apart_m = np.abs((distance_m - theirs_m + period_m / 2) % period_m - period_m / 2)
    judged = ~corrupt & (theirs_m != 64.001)  # that is its code for too little light
    assert judged.mean() > 0.9
    assert apart_m[judged].max() < 2e-5
    amplitude = stored[f"flex_{megahertz}MHz_vendor_amplitude"]
    assert np.abs(np.abs(phasor) / 2 - amplitude)[judged].max() < 1e-3


def test_corrupt_pixels_have_the_highest_code_and_others_keep_theirs() -> None:
    region = Region(0, 119, 2, 121)
    wire = np.full((4, 2, 2), 2048, "<u2")
    wire[:, 0, 0], wire[1, 0, 1], wire[2, 1, 0] = 64002, 64003, 4094
    header = ImageHeader(4, 2, 2, region, (100, 0, 0), 20.0)

    images = dcs_images(header.pack() + wire.tobytes(), region, 100)

    assert images[:, 0, 0].tolist() == [4095] * 4
    assert images[:, 0, 1].tolist() == [2048, 4095, 2048, 2048]
    assert images[:, 1, 0].tolist() == [2048, 2048, 4094, 2048]


@pytest.mark.parametrize(
    "wrong", [{"kind": 1}, {"columns": 79}, {"rows": 0}, {"integration_us": (299, 0, 0)}]
)
def test_images_that_were_not_asked_for_are_lost(wrong: dict[str, int]) -> None:
    header = replace(ImageHeader(4, 80, 60, ROI, (300, 0, 0), 41.25), **wrong)  # type: ignore[arg-type]

    with pytest.raises(ImagesLost, match="in place of"):
        dcs_images(header.pack() + bytes(2 * 4 * 80 * 60), ROI, 300)


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"\xff", "refused GET_DCS: not acknowledged"),
        (b"\xfe", "refused GET_DCS: it is calibrating itself"),
        (b"\x01\x00\x2a", "refused GET_DCS: error 42"),
    ],
)
def test_refusals_say_what_was_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(DeviceRefused, match=reason):
        Answer.of(payload, Command.GET_DCS)


@pytest.mark.parametrize(
    ("head", "reason"),
    [
        (struct.pack("!II", 0xFFFF55AA, 5), "in place of the start marker"),
        (struct.pack("!II", 0xFFFFAA55, 0), "a payload of 0 bytes"),
        (struct.pack("!II", 0xFFFFAA55, 2**31), "a payload of 2147483648 bytes"),
    ],
)
def test_what_is_no_answer_is_refused_before_it_is_read(head: bytes, reason: str) -> None:
    with pytest.raises(ProtocolError, match=reason):
        payload_bytes(head)
    with pytest.raises(ProtocolError, match="end marker"):
        require_end(b"\0\0\0\0")


def test_answers_of_another_type_or_length_are_refused() -> None:
    answer = Answer(AnswerType.TEMPERATURE, b"\x10")

    with pytest.raises(ProtocolError, match="type 4 with 1 bytes, type 4 with 2 expected"):
        answer.fields(AnswerType.TEMPERATURE, "!h")
    with pytest.raises(ProtocolError, match="type 3 with 4 expected"):
        answer.fields(AnswerType.CHIP, "!HH")
    with pytest.raises(ProtocolError, match="calibration data of 6 bytes"):
        unpack_calibration(Answer(AnswerType.CALIBRATION, b"123456"))
    with pytest.raises(ProtocolError, match="without an entry of 24 MHz"):
        offset_m((CalibrationEntry(0, 39.0, 8123),), 41.0)


@given(st.integers(1, 2**16), st.integers(0, 200), st.binary(max_size=300))
def test_no_bytes_make_reading_an_image_fail_otherwise(
    integration_us: int, cut: int, junk: bytes
) -> None:
    region = Region(0, 119, 2, 121)
    data = (junk + bytes(HEADER_BYTES + 32))[: HEADER_BYTES + 32]
    try:
        images = dcs_images(data, region, integration_us)
    except ImagesLost:
        return
    assert images.max(initial=0) <= 4095
