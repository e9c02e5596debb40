"""What is kept of a light that was switched off, on a disk that fails in several ways."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import get_args

import pytest

from transientcam_server.camera import Dark, Darkness
from transientcam_server.camera._darkness import KeptCause

PATIENCE_S = 60.0
CAMERA = "prototype 42"


@contextmanager
def opened(directory: Path, camera: str = CAMERA) -> Iterator[tuple[Darkness, Dark | None]]:
    darkness = Darkness(directory, camera, retry_s=0.01)
    found = darkness.open()
    try:
        yield darkness, found
    finally:
        darkness.close()


def kept(directory: Path, camera: str = CAMERA) -> Dark | None:
    with opened(directory, camera) as (_, found):
        return found


def keep(directory: Path, dark: Dark | None, camera: str = CAMERA) -> None:
    with opened(directory, camera) as (darkness, _):
        darkness.keep(dark)


def file_of(directory: Path) -> Path:
    (file,) = directory.iterdir()
    return file


def test_of_a_camera_that_never_ran_nothing_is_kept(tmp_path: Path) -> None:
    assert kept(tmp_path / "light") is None
    assert kept(tmp_path / "light") is None


@pytest.mark.parametrize("cause", get_args(KeptCause))
def test_why_it_is_off_is_kept_until_it_is_started(tmp_path: Path, cause: KeptCause) -> None:
    keep(tmp_path, Dark(cause, "the interlock \udcff was opened"))
    found = kept(tmp_path)
    again = kept(tmp_path)
    keep(tmp_path, None)

    assert found is not None
    assert found == again == Dark(cause, r"the interlock \udcff was opened")
    assert kept(tmp_path) is None


def test_each_camera_has_its_own(tmp_path: Path) -> None:
    keep(tmp_path, Dark("safe-off"), "sim:mirrors")

    assert kept(tmp_path, "sim:corner") is None
    assert kept(tmp_path, "sim:mirrors") == Dark("safe-off")


def test_what_is_told_last_is_kept(tmp_path: Path) -> None:
    with opened(tmp_path) as (darkness, _):
        for _ in range(20):
            darkness.keep(None)
            darkness.keep(Dark("stop"))
        darkness.written.result(PATIENCE_S)

    assert kept(tmp_path) == Dark("stop")
    assert [each.suffix for each in tmp_path.iterdir()] == [".json"]


def damages(whole: bytes) -> list[bytes]:
    document = json.loads(whole)
    return [
        *(whole[:length] for length in range(0, len(whole), 6)),
        b"\x00" * len(whole),
        b"null",
        b"[]",
        b"\xff" + whole,
        json.dumps({**document, "dark": "a cause of a later version"}).encode(),
        json.dumps({**document, "more": 1}).encode(),
        b"[" * 2**20,
    ]


def test_a_damaged_file_counts_as_dark_and_is_left_until_somebody_starts(tmp_path: Path) -> None:
    kept(tmp_path)
    file = file_of(tmp_path)
    whole = file.read_bytes()
    for damaged in damages(whole):
        file.write_bytes(damaged)
        for _ in range(2):
            found = kept(tmp_path)
            assert found is not None, damaged
            assert found.cause == "unreadable"
            assert str(file) in str(found)
        assert file.read_bytes() == damaged
    keep(tmp_path, None)

    assert kept(tmp_path) is None


def test_a_file_that_cannot_be_read_counts_as_dark(tmp_path: Path) -> None:
    kept(tmp_path)
    file = file_of(tmp_path)
    file.unlink()
    file.mkdir()

    found = kept(tmp_path)

    assert found is not None
    assert found.cause == "unreadable"


def test_where_nothing_can_be_written_it_is_dark_and_says_so_until_it_can(tmp_path: Path) -> None:
    directory = tmp_path / "light"
    directory.write_text("a file is here", encoding="utf-8")

    found = kept(directory)
    assert found is not None
    assert found.cause in ("unreadable", "unwritable")
    assert str(directory) in str(found)

    with opened(directory) as (darkness, _):
        darkness.keep(Dark("safe-off"))
        assert not darkness.written.done()
        directory.unlink()
        darkness.written.result(PATIENCE_S)
    assert kept(directory) == Dark("safe-off")


def test_what_could_be_written_before_and_cannot_now_is_not_said_to_be_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    with opened(tmp_path) as (darkness, _):
        with monkeypatch.context() as patch:
            patch.setattr("transientcam_server.camera._darkness.os.fsync", full)
            darkness.keep(Dark("safe-off"))
            assert not darkness.written.done()
        darkness.written.result(PATIENCE_S)
