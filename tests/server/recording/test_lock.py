"""Locks on unfinished files, of processes and of file systems that have none."""

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from transientcam_server.errors import RecordingInUse
from transientcam_server.recording import _lock as lock


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "a.h5.part"


def _opened() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_a_file_is_taken_while_its_writer_holds_it(path: Path) -> None:
    with lock.create(path):
        assert lock.is_taken(path)
        with pytest.raises(RecordingInUse):
            lock.take(path)

    assert not lock.is_taken(path)
    lock.take(path).close()


def test_a_file_is_taken_while_another_recovers_it(path: Path) -> None:
    path.touch()

    with lock.take(path):
        assert lock.is_taken(path)

    assert not lock.is_taken(path)


def test_a_file_that_is_gone_is_not_taken(path: Path) -> None:
    assert not lock.is_taken(path)


def test_a_writer_lets_other_programs_read(path: Path) -> None:
    with lock.create(path), path.open("rb") as reader:
        fcntl.flock(reader, fcntl.LOCK_SH | fcntl.LOCK_NB)  # as HDF5 does


def test_a_file_is_never_made_twice(path: Path) -> None:
    lock.create(path).close()

    with pytest.raises(FileExistsError):
        lock.create(path)


def test_what_is_refused_leaves_no_open_file(path: Path) -> None:
    before = _opened()
    with lock.create(path):
        assert lock.is_taken(path)
    assert not lock.is_taken(path)

    assert _opened() == before


@pytest.mark.parametrize("masked", [0o022, 0o027, 0])
def test_who_may_read_a_file_is_for_the_service_to_say(path: Path, masked: int) -> None:
    former = os.umask(masked)
    try:
        lock.create(path).close()
    finally:
        os.umask(former)

    assert path.stat().st_mode & 0o777 == 0o666 & ~masked


def test_a_lock_is_of_the_file_and_not_of_its_name(path: Path) -> None:
    with lock.create(path) as held:
        assert held.is_of(path)
        path.rename(path.with_name("b"))
        assert not held.is_of(path)
        assert held.is_of(path.with_name("b"))
        path.touch()
        assert not held.is_of(path)


@pytest.mark.parametrize("make", [lock.create, lock.take])
def test_a_file_that_is_deleted_before_it_is_locked_is_none(
    path: Path, monkeypatch: pytest.MonkeyPatch, make: Callable[[Path], lock.Lock]
) -> None:
    if make is lock.take:
        path.touch()
    flock = fcntl.flock

    def late(descriptor: int, operation: int) -> None:
        path.unlink()
        flock(descriptor, operation)

    monkeypatch.setattr(fcntl, "flock", late)
    before = _opened()

    with pytest.raises(FileNotFoundError) as caught:
        make(path)

    assert caught.value.filename == str(path)
    assert caught.value.errno == errno.ENOENT
    assert _opened() == before


def test_without_locks_files_are_written_with_a_warning(
    path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refused(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)

    with lock.create(path) as held:
        os.write(held.descriptor, b"written")

    assert path.read_bytes() == b"written"
    assert f"{path} cannot be locked" in caplog.text
    assert not lock.is_taken(path)
