import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.conftest import ROOT
from tests.server.recording.made import HEIGHT, WIDTH, assert_same, frame, header, record
from transientcam_server.errors import NotARecording, RecordingInUse
from transientcam_server.recording import (
    DiskFile,
    Recording,
    RecordingWriter,
    _disk as disk,
    _layout as layout,
    _lock as lock,
    recover,
    swmr,
)
from transientcam_server.recording._recovery import recover_all, unfinished

KILLS = 20


def kill_in_mid_recording(
    writers: "subprocess.Popen[bytes]", path: Path, *, after_frames: int
) -> int:
    """Kill a writer that has written so many frames; return how many it acknowledged."""
    assert writers.stdin is not None
    assert writers.stdout is not None
    writers.stdin.write(f"{path}\n".encode())
    writers.stdin.flush()
    acknowledged, process = 0, 0
    while acknowledged < after_frames or not process:  # which of both is first is open
        line = writers.stdout.readline()
        if line.startswith(b"process "):
            process = int(line.split()[1])
        else:
            acknowledged = int(line)
    assert lock.is_taken(path.with_name(path.name + ".part"))
    os.kill(process, signal.SIGKILL)  # wherever it is in the frame after
    while not (line := writers.stdout.readline()).startswith(b"ended"):
        acknowledged = int(line)
    assert line == b"ended by %d\n" % signal.SIGKILL
    return acknowledged


@pytest.mark.timeout(240)
def test_no_acknowledged_frame_is_lost_when_the_writer_is_killed(tmp_path: Path) -> None:
    random_number = random.Random(6)
    with subprocess.Popen(
        [sys.executable, "-m", "tests.server.recording.killed"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
    ) as writers:
        for kill in range(KILLS):
            path = tmp_path / f"{kill}.h5"
            after_frames = random_number.randint(1, 120)
            acknowledged = kill_in_mid_recording(writers, path, after_frames=after_frames)
            assert not path.exists()

            assert recover(path.with_name(path.name + ".part")) == path
            with Recording(path) as recording:
                assert acknowledged <= recording.frames
                for index in (0, acknowledged // 2, recording.frames - 1):
                    assert_same(recording.frame(index), frame(index % 64))
            path.unlink()


def test_a_recovered_recording_is_whole_and_opens_with_anything(tmp_path: Path) -> None:
    part = abandoned(tmp_path / "a.h5", 5)

    path = recover(part)

    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]
    with Recording(path) as recording:
        assert recording.header == header()
        assert recording.annotations == {"kept": True}
        for number in range(5):
            assert_same(recording.frame(number), frame(number))
    with h5py.File(path) as file:  # no SWMR, no special version
        assert file["raw"].dims[0][0].name == "/frame"


def test_a_recovered_recording_has_its_gains_once_under_both_names(tmp_path: Path) -> None:
    planes = np.full((3, HEIGHT, WIDTH), 1 - 2j, np.complex64)
    bad = np.eye(HEIGHT, WIDTH) > 0
    part = abandoned(tmp_path / "a.h5", 2, calibration_planes=planes, calibration_bad=bad)

    with h5py.File(recover(part)) as file:
        np.testing.assert_array_equal(file["gain"][()], planes)
        np.testing.assert_array_equal(file["calibration_bad"][()], bad)
        assert file["gain"] == file["calibration_planes"]
        assert file["bad"] == file["calibration_bad"]
        assert file["gain"].dims[0][0].name == "/moment"
        assert dict(file["kind"].attrs)["flag_meanings"] == "off on modulated"


def test_a_torn_last_frame_is_left_out(tmp_path: Path) -> None:
    part = abandoned(tmp_path / "a.h5", 5)
    with h5py.File(part, swmr=True, libver="latest") as file:
        place = file["raw"].id.get_chunk_info(4)
    with part.open("r+b") as stream:
        stream.seek(place.byte_offset + 20)
        stream.write(bytes(40))

    with Recording(recover(part)) as recording:
        assert recording.frames == 4
        assert_same(recording.frame(3), frame(3))


def test_a_recording_without_a_frame_is_recovered_too(tmp_path: Path) -> None:
    with Recording(recover(abandoned(tmp_path / "a.h5", 0))) as recording:
        assert list(recording) == []


def test_what_cannot_be_read_stays_and_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.h5.part").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    abandoned(tmp_path / "b.h5", 2)

    assert recover_all(unfinished(tmp_path)) == [tmp_path / "b.h5"]
    assert [path.name for path in unfinished(tmp_path)] == ["a.h5.part"]
    with pytest.raises(NotARecording):
        recover(tmp_path / "a.h5.part")


def test_recovery_never_replaces_a_recording_that_has_less(tmp_path: Path) -> None:
    record(tmp_path / "a.h5", 2)
    part = abandoned(tmp_path / "a.h5", 3)

    with pytest.raises(FileExistsError):
        recover(part)
    assert part.exists()


def test_an_unfinished_recording_beside_its_whole_one_is_removed(tmp_path: Path) -> None:
    record(tmp_path / "a.h5", 3)
    part = abandoned(tmp_path / "a.h5", 3)

    assert recover_all([part]) == [tmp_path / "a.h5"]
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]


class Killed(BaseException):
    """Ends a program where it is, as SIGKILL would."""


@pytest.mark.parametrize("steps", range(3))
def test_a_recovery_that_is_killed_between_any_two_steps_leaves_nothing_behind(
    tmp_path: Path, steps: int
) -> None:
    part = abandoned(tmp_path / "a.h5", 3)
    done: list[str] = []

    def step(change: Callable[..., Any]) -> Callable[..., Any]:
        def killed(*arguments: Any, **options: Any) -> Any:
            if len(done) >= steps:
                raise Killed
            done.append(change.__name__)
            return change(*arguments, **options)

        return killed

    with pytest.MonkeyPatch.context() as patch, contextlib.suppress(Killed):
        for name in ("rename", "replace", "unlink"):
            patch.setattr(Path, name, step(getattr(Path, name)))
        recover(part)

    assert done == ["replace", "rename"][:steps]
    recover_all(unfinished(tmp_path))
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.frames == 3


def test_a_copy_that_a_killed_recovery_left_is_removed_with_its_recording_gone(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.h5.scratch").write_bytes(b"half")

    assert unfinished(tmp_path) == []
    assert not list(tmp_path.iterdir())


def test_what_another_service_begins_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_disk = disk.open_disk

    def started_meanwhile(path: Path, mode: str) -> tuple[swmr.File, DiskFile]:
        assert unfinished(tmp_path) == []  # as another service does when it starts
        return open_disk(path, mode)

    monkeypatch.setattr(disk, "open_disk", started_meanwhile)

    record(tmp_path / "a.h5", 1)

    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_what_is_being_written_is_not_recovered(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))

    assert unfinished(tmp_path) == []
    with pytest.raises(RecordingInUse):
        recover(writer.part)
    writer.append(frame(1))
    writer.close({})
    with Recording(tmp_path / "a.h5") as recording:
        assert recording.frames == 2


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8, 0.999])
def test_a_start_that_is_refused_leaves_no_file_and_no_descriptor(
    tmp_path: Path, share: float
) -> None:
    size_bytes = len(layout.image(header(), {}))
    before = len(list(Path("/proc/self/fd").iterdir()))

    with limited_files(int(share * size_bytes)), pytest.raises(OSError, match="File too large"):
        RecordingWriter(tmp_path / "a.h5", header())

    assert not list(tmp_path.iterdir())
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_recovery_without_room_leaves_everything_as_it_was(tmp_path: Path) -> None:
    part = abandoned(tmp_path / "a.h5", 40)

    with limited_files(part.stat().st_size // 2), pytest.raises((OSError, NotARecording)):
        recover(part)

    assert [each.name for each in tmp_path.iterdir()] == ["a.h5.part"]
    with Recording(recover(part)) as recording:
        assert recording.frames == 40


def abandoned(path: Path, frames: int, **changes: Any) -> Path:
    """What a writer leaves that is killed after so many frames."""
    whole = path.with_name("alive.h5")
    writer = RecordingWriter(whole, header(**changes), annotations={"kept": True})
    for number in range(frames):
        writer.append(frame(number))
    part = path.with_name(path.name + ".part")
    part.write_bytes(writer.part.read_bytes())
    writer.close({})
    whole.unlink()
    return part


@contextmanager
def limited_files(size_bytes: int) -> Iterator[None]:
    """Let no file of this process grow larger: the kernel's own EFBIG."""
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
