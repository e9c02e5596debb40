"""Disks that fail while HDF5 writes."""

import errno
import itertools
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import h5py
import numpy as np
import pytest

from tests.conftest import ROOT
from tests.server.recording.failing import FAULTS, FailingDisk, Fault, calls, tried, tried_below
from tests.server.recording.made import frame, header
from transientcam_server.recording import DiskFile, Recording, RecordingWriter, open_to_write
from transientcam_server.recording._seal import sealed_frames

SLICES = 8
LIVES_ON = """
from pathlib import Path
from typing import Any
from tests.server.recording.made import frame, header
from transientcam_server.recording import RecordingWriter
writer = RecordingWriter(Path(r"{}"), header())
writer.append(frame(0))
"""


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> int:
    """How many writes and fsyncs a recording takes."""
    return calls(tmp_path_factory.mktemp("whole"))


@pytest.mark.parametrize("part", range(SLICES))
def test_what_was_counted_is_kept_whichever_call_fails(
    places: int, part: int, tmp_path: Path
) -> None:
    # each call fails once or for ever, in turns, with each kind of fault in turn
    faults = [
        Fault(at, kind, for_ever=at // len(FAULTS) % 2 == 0)
        for at, kind in zip(range(1, places + 1), itertools.cycle(FAULTS), strict=False)
        if at % SLICES == part
    ]
    ended = {fault: tried(tmp_path, fault) for fault in faults}

    assert len({fault.for_ever for fault in faults}) == 2
    assert set(ended.values()) <= {"refused", "failed", "stopped"}
    assert "stopped" not in {how for fault, how in ended.items() if fault.for_ever}


@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
@pytest.mark.parametrize("at", [9, 40])
def test_the_process_lives_on_where_the_system_refuses_every_write(at: int, tmp_path: Path) -> None:
    assert tried_below(tmp_path, Fault(at, "EIO", for_ever=True)) == "failed"


def test_hdf5_reads_again_what_could_not_be_written(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with open_to_write(path, "x") as (file, _):
        file["old"] = np.arange(3)
    before = path.read_bytes()

    disk = DiskFile(path, "r+")
    with FailingDisk(Fault(1, "EIO", for_ever=True)).inserted(), h5py.File(disk, "r+") as file:
        file["new"] = np.arange(5)
        file.flush()
        assert file["new"][()].tolist() == [0, 1, 2, 3, 4]

    with pytest.raises(OSError, match="Input/output error"):
        disk.synchronise()
    assert path.read_bytes() == before


def test_an_fsync_that_failed_is_not_tried_again(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))
    with FailingDisk(Fault(1, "EIO")).inserted(), pytest.raises(OSError, match="Input/output"):
        writer.synchronise(10.0)

    assert writer.synchronised_frames == 0
    refused: list[Callable[[], None]] = [
        lambda: writer.synchronise(20.0),
        lambda: writer.append(frame(1)),
        lambda: writer.close({}),
    ]
    for each in refused:
        with pytest.raises(OSError, match="Input/output error"):
            each()
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5.part"]


def test_a_disk_that_cannot_be_read_any_more_does_no_harm_either(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    for number in range(3):
        writer.append(frame(number))
    gone = OSError(errno.EIO, os.strerror(errno.EIO))
    calls: dict[str, Any] = dict.fromkeys(
        ("pread", "pwrite", "fsync", "ftruncate"), mock.Mock(side_effect=gone)
    )

    with mock.patch.multiple(os, **calls):
        with pytest.raises(OSError, match="Input/output error"):
            writer.append(frame(3))
        with pytest.raises(OSError, match="Input/output error"):
            writer.close({})

    assert len(sealed_frames(writer.part)) == 3


def test_an_interruption_does_not_reach_hdf5(tmp_path: Path) -> None:
    disk = DiskFile(tmp_path / "a.h5", "x")
    with (
        mock.patch.object(os, "pwrite", side_effect=KeyboardInterrupt),
        h5py.File(disk, "w") as file,
    ):
        file["a"] = 1
        file.flush()

    with pytest.raises(KeyboardInterrupt):
        disk.require_written()


def test_a_process_may_end_with_a_recording_open(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    paths = os.pathsep.join([str(ROOT), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", LIVES_ON.format(path)],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        check=False,
    )

    assert (done.returncode, done.stderr) == (0, b"")
    with Recording(path.with_name("a.h5.part")) as recording:
        assert recording.frames == 1


def test_other_programs_read_a_file_that_grows(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))
    reading = (
        "import h5py, sys\n"
        "with h5py.File(sys.argv[1], 'r', swmr=True) as file:\n"
        "    print(len(file['frame']), flush=True)\n"
        "    sys.stdin.readline()\n"
        "    file['frame'].refresh()\n"
        "    print(len(file['frame']), flush=True)\n"
    )
    command = [sys.executable, "-c", reading, str(writer.part)]
    with subprocess.Popen(command, stdin=-1, stdout=-1, text=True) as other:
        assert other.stdin is not None
        assert other.stdout is not None
        assert other.stdout.readline() == "1\n"
        writer.append(frame(1))
        other.stdin.write("\n")
        other.stdin.flush()
        assert other.stdout.readline() == "2\n"
    writer.close({})
    with h5py.File(writer.path) as file:  # no mark of an open file is left
        assert len(file["frame"]) == 2


def test_a_file_that_is_there_is_not_made_anew(tmp_path: Path) -> None:
    (tmp_path / "a.h5").touch()

    with pytest.raises(FileExistsError):
        DiskFile(tmp_path / "a.h5", "x")
