"""Files are closed by their writer when no reader in its process has them open."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from transientcam_server.recording._readers import Readers


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a"
    path.touch()
    return path


@contextmanager
def writer_of(path: Path) -> Iterator[int]:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def test_a_writer_waits_for_those_who_read(path: Path) -> None:
    readers, order = Readers(), list[str]()

    def end() -> None:
        with writer_of(path) as descriptor, readers.ending(descriptor):
            order.append("ended")

    with readers.reading(path):
        with readers.reading(path):
            ending = threading.Thread(target=end)
            ending.start()
        order.append("one has read")
        order.append("all have read")
    ending.join()

    assert order == ["one has read", "all have read", "ended"]


def test_who_comes_meanwhile_waits_for_the_writer(path: Path) -> None:
    readers, order = Readers(), list[str]()
    begun = threading.Event()

    def read() -> None:
        begun.set()
        with readers.reading(path):
            order.append("read")

    with writer_of(path) as descriptor, readers.ending(descriptor):
        reading = threading.Thread(target=read)
        reading.start()
        begun.wait()
        order.append("ended")
    reading.join()

    assert order == ["ended", "read"]


def test_a_reader_that_never_ends_is_not_waited_for_forever(path: Path) -> None:
    readers = Readers(patience_s=0.01)

    with readers.reading(path), writer_of(path) as descriptor, readers.ending(descriptor):
        pass


def test_readers_of_other_files_are_not_waited_for(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "b"
    other.touch()
    readers = Readers(patience_s=float("inf"))

    with readers.reading(other), writer_of(path) as descriptor, readers.ending(descriptor):
        pass
    assert not readers._ending


def test_a_file_that_is_gone_is_not_read(tmp_path: Path) -> None:
    readers = Readers()

    with pytest.raises(FileNotFoundError), readers.reading(tmp_path / "a"):
        pass
    assert not readers._open
