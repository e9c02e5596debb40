"""What files and running recordings are described as."""

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import h5py
import pytest

from tests.server.recording.made import APPLIED, CAPABILITIES, frame, header, record
from tests.server.recording.test_recovery import abandoned
from transientcam_server.recording import (
    Limits,
    RecordingWriter,
    _descriptions as descriptions,
    _layout as layout,
)
from transientcam_server.recording._descriptions import Descriptions, of_recorder, of_removed
from transientcam_server.recording._recorder import Recorder

OF_HEADER: dict[str, Any] = {
    "name": "Möbius strip, 3 m",
    "started_s": 1795161600.25,
    "sequence": APPLIED.to_document(),
    "camera": {"model": CAPABILITIES.model, "serial": CAPABILITIES.serial, **header().camera},
    "calibration": {"id": "nominal"},
    "width": 16,
    "height": 12,
    "versions": dict(header().versions),
}
NOTHING: dict[str, Any] = {
    "name": "",
    "started_s": None,
    "frames": 0,
    "synced_frames": None,
    "dropped_frames": 0,
    "duration_s": 0.0,
    "reason": None,
    "annotations": {},
    "sequence": None,
    "camera": {},
    "calibration": {},
    "width": None,
    "height": None,
    "versions": {},
    "limits": None,
}


def described(path: Path) -> dict[str, Any]:
    document = Descriptions().of_file(path)
    assert document is not None
    return document


def test_a_file_is_read_again_only_where_it_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "a.h5", 1)
    reading = Mock(return_value={"state": "complete"})
    monkeypatch.setattr(descriptions, "_read", reading)
    known = Descriptions()

    for _ in range(3):
        known.of_file(path)
    path.touch()
    known.of_file(path)
    known.keep(set())
    known.of_file(path)

    assert reading.call_count == 3


def test_a_whole_recording_is_described_by_its_header_and_end(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 3, annotations={"k": 1})

    assert described(path) == OF_HEADER | {
        "id": "a",
        "state": "complete",
        "frames": 3,
        "synced_frames": 3,
        "dropped_frames": 0,
        "duration_s": pytest.approx(0.3),
        "reason": "stopped",
        "problem": None,
        "annotations": {"k": 1},
        "size_bytes": path.stat().st_size,
        "limits": None,
    }


def test_dropped_frames_are_summed(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    for number in range(3):
        writer.append(frame(number), dropped_frames=number + 1)
    writer.close({"reason": "disk-space", "problem": "full"})

    document = described(tmp_path / "a.h5")

    assert document["dropped_frames"] == 6
    assert (document["reason"], document["problem"]) == ("disk-space", "full")


@pytest.mark.parametrize(("frames", "duration_s"), [(0, 0.0), (1, 0.0), (4, 0.3)])
def test_an_interrupted_recording_lasted_from_its_first_frame_to_its_last(
    tmp_path: Path, frames: int, duration_s: float
) -> None:
    document = described(abandoned(tmp_path / "a.h5", frames))

    assert (document["state"], document["reason"]) == ("interrupted", "interrupted")
    assert (document["id"], document["frames"]) == ("a", frames)
    assert document["duration_s"] == pytest.approx(duration_s)


def test_what_another_service_writes_is_being_recorded(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())

    assert described(writer.part)["state"] == "recording"
    writer.close({})


def test_a_file_that_cannot_be_read_is_damaged_and_empty(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(b"no HDF5")

    document = described(path)

    assert document.pop("problem")
    assert document == NOTHING | {"id": "a", "state": "damaged", "size_bytes": 7}
    assert Descriptions().of_file(tmp_path / "b.h5") is None


def test_a_file_is_read_again_when_it_has_changed(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 1)
    descriptions = Descriptions()
    first = descriptions.of_file(path)
    with h5py.File(path, "r+") as file:
        file["annotations"][()] = layout.encoded({"new": True})

    again = descriptions.of_file(path)

    assert first is not None
    assert again is not None
    assert (first["annotations"], again["annotations"]) == ({}, {"new": True})
    assert len(descriptions) == 1
    descriptions.keep({"b"})
    assert not len(descriptions)


def test_a_recording_that_runs_is_described_by_its_progress(tmp_path: Path) -> None:
    now_s = 100.0
    writer = RecordingWriter(tmp_path / "a.h5", header(), annotations={"k": 1})
    recorder = Recorder(
        writer,
        header(),
        limits=Limits(duration_s=60.0, frames=9),
        annotations={"k": 1},
        queue_frames=1,
        free_bytes=lambda: 10**15,
        clock=lambda: now_s,
    )
    for number in range(3):  # of which one has room
        recorder.offer(frame(number), APPLIED)
    recorder._step()
    now_s = 101.5

    running = of_recorder(recorder)
    recorder.stop()
    stopped = of_recorder(recorder)
    removed = of_removed(recorder)

    assert running == OF_HEADER | {
        "id": header().recording_id,
        "state": "recording",
        "frames": 1,
        "synced_frames": 1,
        "dropped_frames": 2,
        "duration_s": 1.5,
        "size_bytes": writer.bytes_written,
        "reason": None,
        "problem": None,
        "limits": {"duration_s": 60.0, "size_bytes": None, "frames": 9, "free_bytes": 0},
        "annotations": {"k": 1},
    }
    assert (stopped["state"], stopped["reason"]) == ("finishing", "stopped")
    assert removed == NOTHING | OF_HEADER | {
        "id": header().recording_id,
        "state": "damaged",
        "size_bytes": 0,
        "dropped_frames": 2,
        "duration_s": 1.5,
        "reason": "stopped",
        "problem": None,
    }
    recorder.start()
    assert recorder.wait(60.0)
