"""Dates, checksums and documents of recordings at their limits."""

import zlib
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.server.recording.made import frame, header, record
from transientcam_server.errors import NotARecording
from transientcam_server.recording import Recording, _layout as layout


@pytest.mark.parametrize(
    ("unix_s", "date"),
    [
        (-1.0, datetime(1970, 1, 1, tzinfo=UTC)),
        (0.0, datetime(1970, 1, 1, tzinfo=UTC)),
        (0.5, datetime(1970, 1, 1, 0, 0, 0, 500_000, tzinfo=UTC)),
        (951782400.0, datetime(2000, 2, 29, tzinfo=UTC)),
        (1e300, datetime(9999, 12, 31, tzinfo=UTC)),
    ],
)
def test_a_time_beyond_the_calendar_is_its_first_or_last_day(unix_s: float, date: datetime) -> None:
    assert layout.utc(unix_s) == date


@pytest.mark.parametrize("dtype", ["<u2", ">u2"])
def test_the_checksum_is_that_of_zlib_over_little_endian_values(dtype: str) -> None:
    images = frame(3).images

    expected = zlib.crc32(images.astype("<u2").tobytes())
    assert layout.checksum(images.astype(dtype)) == expected
    assert layout.checksum(np.repeat(images, 2, axis=2)[:, :, ::2]) == expected


def test_a_row_has_what_a_frame_states() -> None:
    raw = frame(3)

    row = layout.row(raw, dropped_frames=4)

    assert row == {
        "epoch": 7,
        "device_time_s": raw.device_time_s,
        "host_time_s": raw.host_time_s,
        "capture_s": raw.capture_s,
        "temperature_c": raw.temperature_c,
        "lost_images": raw.lost_images,
        "dropped_frames": 4,
        "crc32": zlib.crc32(raw.images.tobytes()),
        "device_frame": 3,
    }
    assert list(row) == list(layout.SERIES)


def test_a_file_states_its_format_and_has_room_for_texts(tmp_path: Path) -> None:
    with h5py.File(record(tmp_path / "a.h5", 1)) as file:
        assert (file.attrs["format"], file.attrs["format_version"]) == ("transientcam recording", 1)
        assert file.attrs["seals"] == 1
        assert file.attrs["Conventions"] == "CF-1.11"
        assert file["annotations"].dtype == "S16384"
        assert file["end"].dtype == "S4096"
        assert file["image"][()].tolist() == list(range(8))
        assert file["x"][()].tolist() == list(range(16))


@pytest.mark.parametrize(("bits", "readable"), [(0, False), (1, True), (16, True), (17, False)])
def test_pixels_have_1_to_16_bits(tmp_path: Path, bits: int, *, readable: bool) -> None:
    path = record(tmp_path / "a.h5", 1)
    with h5py.File(path, "r+") as file:
        stated = layout.parsed(file.attrs["capabilities"])
        file.attrs["capabilities"] = layout.encoded(stated | {"bits": bits}).decode()

    if readable:
        with Recording(path) as recording:
            assert recording.header.capabilities.bits == bits
    else:
        with pytest.raises(NotARecording, match=f"its images have {bits} bits"):
            Recording(path)


@pytest.mark.parametrize(
    ("end", "readable"),
    [
        ({"duration_s": 0}, True),
        ({"duration_s": 1e12}, True),
        ({"duration_s": 1.0000001e12}, False),
        ({"duration_s": -1e-9}, False),
        ({"duration_s": 10**400}, False),
        ({"duration_s": True}, False),
        ({"duration_s": None}, False),
        ({"reason": None, "problem": None}, True),
        ({"reason": "stopped", "problem": "none"}, True),
        ({"reason": 1}, False),
        ({"problem": []}, False),
    ],
)
def test_an_end_is_one_that_a_recorder_states(
    tmp_path: Path, end: dict[str, Any], *, readable: bool
) -> None:
    path = record(tmp_path / "a.h5", 1)
    with h5py.File(path, "r+") as file:
        file["end"][()] = layout.encoded(end)

    if readable:
        with Recording(path) as recording:
            assert recording.end == end
    else:
        with pytest.raises(NotARecording, match=f"end.{next(iter(end))} is "):
            Recording(path)


@pytest.mark.parametrize("planes", ["(m+1,)", "(m+1, H, W)"])
def test_gains_are_of_moments_or_of_moments_and_pixels(tmp_path: Path, planes: str) -> None:
    shape = (3,) if planes == "(m+1,)" else (3, 12, 16)
    gains = np.full(shape, 2 - 1j, np.complex64)
    path = record(tmp_path / "a.h5", 1, calibration_planes=gains)

    with Recording(path) as recording:
        np.testing.assert_array_equal(recording.header.calibration_planes, gains)
        assert recording.header.gains is not None
        assert recording.header.gains.id == "nominal"
    with h5py.File(path, "r+") as file:
        del file["calibration_planes"]
        file["calibration_planes"] = gains[:2]
    with pytest.raises(NotARecording, match="its gains are complex64 of shape"):
        Recording(path)


def test_a_recording_without_gains_has_the_nominal_ones() -> None:
    assert header().gains is None
