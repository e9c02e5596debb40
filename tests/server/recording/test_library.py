"""What the service keeps of recordings, beside their files."""

import os
import re
import shutil
import threading
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from tests.server.recording.failing import FailingDisk, Fault
from tests.server.recording.made import APPLIED, HEIGHT, WIDTH, frame, header, record
from tests.server.recording.test_recovery import abandoned
from tests.waiting import wait_until
from transientcam_server.errors import Problem
from transientcam_server.recording import (
    Header,
    Library,
    Limits,
    Recording,
    RecordingOptions,
    _descriptions as descriptions,
    _layout as layout,
)
from transientcam_server.recording._descriptions import Descriptions
from transientcam_server.recording._directory import Directory
from transientcam_server.settings import RecordingSettings

IDS = [f"20261120T08150{number}Z-3f9c2a" for number in range(4)]


def new_header(recording_id: str, name: str, started_s: float) -> Header:
    return header(recording_id=recording_id, name=name, started_s=started_s)


@pytest.fixture
def library(tmp_path: Path) -> Library:
    """One with a few recordings that others have made."""
    for each in IDS:
        record(tmp_path / f"{each}{layout.SUFFIX}", 2, recording_id=each)

    return Library(RecordingSettings(directory=tmp_path), header=new_header)


def test_what_is_deleted_is_forgotten(library: Library) -> None:
    assert len(library.describe_all()) == len(IDS)

    for deleted, each in enumerate(IDS, start=1):
        library.delete(each)
        assert len(library._descriptions) == len(IDS) - deleted


def test_what_others_deleted_is_forgotten(library: Library, tmp_path: Path) -> None:
    assert len(library.describe_all()) == len(IDS)
    for path in tmp_path.glob("*.h5"):
        path.unlink()

    assert library.describe_all() == []
    assert not len(library._descriptions)
    with pytest.raises(Problem, match=IDS[0]):
        library.describe(IDS[0])


def test_what_is_deleted_while_it_is_described_is_unknown(
    library: Library, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = descriptions._read

    def deleted(path: Path) -> dict[str, Any]:
        path.unlink()
        return read(path)

    monkeypatch.setattr(descriptions, "_read", deleted)

    with pytest.raises(Problem, match=IDS[0]):
        library.describe(IDS[0])
    assert library.describe_all() == []


def test_what_is_finished_while_it_is_described_is_described(
    library: Library, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = tmp_path / f"{IDS[0]}{layout.SUFFIX}"
    whole.rename(tmp_path / f"{IDS[0]}{layout.PART_SUFFIX}")
    find = Directory.find

    def finished(self: Directory, recording_id: str) -> Path | None:
        found = find(self, recording_id)
        if found is not None and found != whole:
            found.rename(whole)
        return found

    monkeypatch.setattr(Directory, "find", finished)

    assert library.describe(IDS[0])["state"] == "complete"


class Busy(frozenset[str]):
    """Ids; a look-up is interrupted by another thread that describes another file."""

    descriptions: Descriptions
    others: list[Path]

    def __contains__(self, item: object) -> bool:
        if self.others:
            self.descriptions.of_file(self.others.pop())
        return super().__contains__(item)


def test_a_file_may_be_described_while_others_are_forgotten(tmp_path: Path) -> None:
    paths = [record(tmp_path / f"{each}{layout.SUFFIX}", 2, recording_id=each) for each in IDS]
    descriptions = Descriptions()
    for path in paths[:2]:
        descriptions.of_file(path)
    ids = Busy(IDS[1:])
    ids.descriptions, ids.others = descriptions, paths[2:]

    descriptions.keep(ids)

    assert len(descriptions) == len(IDS) - 1


@pytest.fixture
def two(tmp_path: Path) -> Iterator[tuple[Library, Library]]:
    """Two services on one directory; the first one records."""
    settings = RecordingSettings(directory=tmp_path, min_free_bytes=0)
    first, second = (Library(settings, header=new_header) for _ in range(2))
    first.open()
    first.start(RecordingOptions())
    second.open()
    yield first, second
    first.close()
    second.close()


def test_what_another_service_writes_is_neither_deleted_nor_recovered(
    two: tuple[Library, Library],
) -> None:
    first, second = two
    running = first.active_id
    assert running is not None
    first.offer(frame(0), APPLIED)

    assert second.describe(running)["state"] == "recording"
    with pytest.raises(Problem, match="not finished") as refused:
        second.delete(running)

    assert refused.value.kind.status == 409
    first.offer(frame(1), APPLIED)
    stopped = first.stop(running)
    assert (stopped["state"], stopped["frames"]) == ("complete", 2)
    second.delete(running)
    with pytest.raises(Problem, match="no recording"):
        first.describe(running)


def test_what_a_killed_service_left_is_recovered_while_another_one_records(
    two: tuple[Library, Library], tmp_path: Path
) -> None:
    abandoned(tmp_path / f"{IDS[0]}.h5", 2)
    third = Library(RecordingSettings(directory=tmp_path), header=new_header)
    third.open()
    third.close()

    assert third.describe(IDS[0])["state"] == "complete"
    assert third.describe(str(two[0].active_id))["state"] == "recording"


def test_a_deleted_recording_never_comes_back(library: Library, tmp_path: Path) -> None:
    abandoned(tmp_path / f"{IDS[0]}.h5", 3)  # as a recovery of an earlier version left it
    (tmp_path / f"{IDS[0]}.h5.scratch").write_bytes(b"half")

    library.delete(IDS[0])
    library.open()
    library.close()

    assert IDS[0] not in [each["id"] for each in library.describe_all()]
    assert not list(tmp_path.glob(f"{IDS[0]}*"))


def test_a_directory_that_was_removed_while_recording_is_said(tmp_path: Path) -> None:
    ended = threading.Event()
    directory = tmp_path / "kept"
    library = Library(
        RecordingSettings(directory=directory, min_free_bytes=0),
        header=new_header,
        notify=lambda kind, details: ended.set() if kind == "recording-stopped" else None,
    )
    running = library.start(RecordingOptions())["id"]
    shutil.rmtree(directory)
    assert ended.wait(60.0)

    (listed,) = library.describe_all()
    assert (listed["id"], listed["state"], listed["reason"]) == (running, "damaged", "failed")
    assert "removed" in listed["problem"]
    assert library.stop(running) == listed
    library.delete(running)
    assert library.describe_all() == []
    library.close()


def test_a_clock_beyond_the_year_9999_can_be_recorded_by(tmp_path: Path) -> None:
    library = Library(
        RecordingSettings(directory=tmp_path, min_free_bytes=0),
        header=new_header,
        unix_s=lambda: 3e11,
    )

    running = library.start(RecordingOptions())
    library.close()

    assert running["started_s"] == 3e11
    assert library.describe(running["id"])["state"] == "complete"


@pytest.mark.parametrize(
    ("requested", "ends_at"),
    [
        (Limits(), Limits(60.0, 10_000_000, None, 1000)),
        (Limits(59.0, 9_000_000, 7, 2000), Limits(59.0, 9_000_000, 7, 2000)),
        (Limits(61.0, 11_000_000, 7, 999), Limits(60.0, 10_000_000, 7, 1000)),
    ],
)
def test_a_recording_ends_at_the_narrower_of_two_limits(
    tmp_path: Path, requested: Limits, ends_at: Limits
) -> None:
    settings = RecordingSettings(
        directory=tmp_path, max_duration_s=60.0, max_bytes=10_000_000, min_free_bytes=1000
    )
    library = Library(settings, header=new_header)

    document = library.start(RecordingOptions(limits=requested))

    assert document["limits"] == asdict(ends_at)
    library.close()


@pytest.mark.parametrize(("free_bytes", "there_is_room"), [(1000, True), (999, False)])
def test_a_recording_begins_where_as_much_is_free_as_has_to_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free_bytes: int, *, there_is_room: bool
) -> None:
    monkeypatch.setattr(Directory, "free_bytes", lambda self: free_bytes)
    library = Library(RecordingSettings(directory=tmp_path, min_free_bytes=1000), header=new_header)

    if there_is_room:
        library.start(RecordingOptions())
    else:
        with pytest.raises(Problem, match="999 bytes are free, 1000 have to stay so"):
            library.start(RecordingOptions())
    library.close()


@pytest.mark.parametrize(
    ("frames_bytes", "depth"), [(0, 2), (2.99, 2), (3.0, 3), (3.99, 3), (10.0, 10)]
)
def test_frames_wait_for_the_disk_within_their_memory_and_two_at_least(
    tmp_path: Path, frames_bytes: float, depth: int
) -> None:
    frame_bytes = 8 * HEIGHT * WIDTH * 2
    settings = RecordingSettings(directory=tmp_path, min_free_bytes=0)
    settings = settings.model_copy(update={"queue_bytes": int(frames_bytes * frame_bytes)})

    assert Library(settings, header=new_header)._queue_frames(header()) == depth


def test_a_recording_without_a_name_is_called_by_its_begin_in_utc(tmp_path: Path) -> None:
    settings = RecordingSettings(directory=tmp_path, min_free_bytes=0)
    library = Library(settings, header=new_header, unix_s=lambda: 951782400.9)

    document = library.start(RecordingOptions())
    library.close()

    assert document["name"] == "Recording of 2000-02-29 00:00:00 UTC"
    assert re.fullmatch(r"20000229T000000Z-[0-9a-f]{6}", document["id"])
    assert library.active_id is None


def test_recordings_are_listed_newest_first(tmp_path: Path) -> None:
    for name, started_s in (("b", 20.0), ("a", 10.0), ("d", 20.0), ("c", 30.0)):
        record(tmp_path / f"{name}.h5", 0, recording_id=name, started_s=started_s)
    (tmp_path / "e.h5").write_bytes(b"no recording")

    library = Library(RecordingSettings(directory=tmp_path), header=new_header)

    assert [each["id"] for each in library.describe_all()] == ["c", "d", "b", "a", "e"]


class Hanging:
    """A disk that takes no more, until it is let."""

    def __init__(self) -> None:
        self.free = threading.Event()
        self.free.set()
        self.waits = threading.Event()

    def around(self, call: Any) -> Any:
        """Return a call of the system that waits."""

        def waiting(*arguments: Any) -> Any:
            if not self.free.is_set():
                self.waits.set()
            self.free.wait()
            return call(*arguments)

        return waiting


@pytest.fixture
def hanging() -> Iterator[Hanging]:
    disk = Hanging()
    calls: dict[str, Any] = {name: disk.around(getattr(os, name)) for name in ("pwrite", "fsync")}
    with mock.patch.multiple(os, **calls):
        yield disk
        disk.free.set()


def test_a_recording_whose_disk_hangs_says_so_and_ends_without_it(
    tmp_path: Path, hanging: Hanging
) -> None:
    notices: list[str] = []
    settings = RecordingSettings(directory=tmp_path, min_free_bytes=0, stalled_s=0.05)
    library = Library(settings, header=new_header, notify=lambda kind, _: notices.append(kind))
    recording = library.start(RecordingOptions())["id"]
    library.offer(frame(0), APPLIED)
    wait_until(lambda: library.totals.frames == 1)
    hanging.free.clear()
    library.offer(frame(1), APPLIED)
    assert hanging.waits.wait(60.0)

    wait_until(lambda: library.disk_waiting_s > 0.1)
    for _ in range(2):
        library.offer(frame(2), APPLIED)
    assert notices == ["recording-started", "disk-stalled"]
    library.close()

    part = tmp_path / f"{recording}{layout.PART_SUFFIX}"
    assert part.exists()
    copy = Path(shutil.copy(part, tmp_path / "copy.h5.part"))  # as a killed process leaves it
    hanging.free.set()
    with Recording(copy) as kept:
        assert kept.frames >= 1
    wait_until(lambda: library.active_id is None)
    assert not part.exists()
    assert library.disk_waiting_s == 0.0


def test_frames_on_the_disk_are_said(tmp_path: Path) -> None:
    settings = RecordingSettings(directory=tmp_path, min_free_bytes=0)
    library = Library(settings, header=new_header)
    recording = library.start(RecordingOptions())["id"]
    library.offer(frame(0), APPLIED)
    wait_until(lambda: library.totals.frames == 1)

    running = library.describe(recording)
    assert 0 <= running["synced_frames"] <= running["frames"]
    assert library.stop(recording)["synced_frames"] == 1
    library.close()


def test_a_recording_that_failed_says_why_and_what_is_on_the_disk(tmp_path: Path) -> None:
    settings = RecordingSettings(directory=tmp_path, min_free_bytes=0)
    library = Library(settings, header=new_header)
    recording = library.start(RecordingOptions())["id"]
    with FailingDisk(Fault(1, "EIO", for_ever=True)).inserted():
        library.offer(frame(0), APPLIED)
        wait_until(lambda: library.active_id is None)

    failed = library.describe(recording)
    assert (failed["state"], failed["reason"]) == ("interrupted", "failed")
    assert failed["problem"] == "Input/output error"
    assert failed["synced_frames"] == 0
    library.start(RecordingOptions())  # the next one may work
    library.close()
