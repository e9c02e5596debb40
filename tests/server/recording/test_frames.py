"""Frames of recordings: when they arrived, and which there are."""

from pathlib import Path

import numpy as np
import pytest

from tests.server.recording.made import record
from transientcam_server.errors import Problem
from transientcam_server.recording import timeline
from transientcam_server.recording._frames import MAX_TIMES, _read_frame, _read_times, open_found


@pytest.mark.parametrize(
    ("count", "step"), [(2, 1), (4096, 1), (4097, 2), (8192, 2), (8193, 3), (12289, 4)]
)
def test_a_timeline_of_a_long_recording_is_thinned_out(count: int, step: int) -> None:
    host_time_s = 1e9 + np.arange(count) / 10.0

    found = timeline(host_time_s)

    assert (found["first"], found["last"], found["count"]) == (1, count, count)
    assert found["times_step"] == step
    assert len(found["times_s"]) <= MAX_TIMES == 4096
    np.testing.assert_allclose(found["times_s"], np.arange(0, count, step) / 10.0)
    assert found["duration_s"] == pytest.approx((count - 1) / 10.0)
    assert found["frame_rate_hz"] == pytest.approx(10.0)
    assert found["host_time_s"] == 1e9


def test_times_are_stated_to_a_microsecond() -> None:
    assert timeline(np.array([0.0, 0.123456789]))["times_s"] == [0.0, 0.123457]


def test_a_recording_without_frames_has_an_empty_timeline() -> None:
    assert timeline(np.empty(0)) == {
        "first": None,
        "last": None,
        "count": 0,
        "duration_s": 0.0,
        "frame_rate_hz": None,
        "host_time_s": None,
        "times_s": [],
        "times_step": 1,
    }


def test_one_frame_has_no_rate() -> None:
    found = timeline(np.array([5.0]))

    assert (found["first"], found["last"], found["count"]) == (1, 1, 1)
    assert (found["duration_s"], found["frame_rate_hz"]) == (0.0, None)
    assert (found["host_time_s"], found["times_s"]) == (5.0, [0.0])


def test_frames_are_counted_from_one(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 2)

    assert [_read_frame(lambda: path, number).number for number in (1, 2)] == [0, 1]
    assert np.diff(_read_times(lambda: path)) == pytest.approx(0.1)
    for number in (0, 3, -1):
        with pytest.raises(Problem, match=r"no frame -?\d; it has frames 1 to 2") as caught:
            _read_frame(lambda: path, number)
        said = caught.value.extensions
        assert (said["first"], said["last"], said["limit"]) == (1, 2, "from 1 to 2")


def test_a_recording_that_has_no_frame_yet_says_so(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 0)

    with pytest.raises(Problem, match="it has none yet") as caught:
        _read_frame(lambda: path, 1)
    said = caught.value.extensions
    assert (said["first"], said["last"], said["limit"]) == (None, None, None)


def test_a_file_that_is_renamed_while_it_is_opened_is_found_again(tmp_path: Path) -> None:
    paths = iter([tmp_path / "a.h5.part", record(tmp_path / "a.h5", 1)])

    with open_found(lambda: next(paths)) as recording:
        assert recording.frames == 1


def test_a_file_that_is_no_recording_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(b"no HDF5")

    with pytest.raises(Problem) as caught:
        open_found(lambda: path)
    assert caught.value.kind.slug == "recording-damaged"
