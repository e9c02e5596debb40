"""The files of recordings, found while others are written and finished."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from transientcam_server.errors import RecordingInUse
from transientcam_server.recording import _lock as lock
from transientcam_server.recording._directory import Directory


def test_a_recording_that_is_finished_while_its_directory_is_read_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unfinished, whole = tmp_path / "light.h5.part", tmp_path / "light.h5"
    unfinished.touch()
    listing = Path.iterdir

    def finished_meanwhile(self: Path) -> Iterator[Path]:
        entries = list(listing(self))
        if unfinished.exists():
            unfinished.rename(whole)
        return iter(entries)

    monkeypatch.setattr(Path, "iterdir", finished_meanwhile)
    directory = Directory(tmp_path)

    assert directory.find("light") == whole


def test_links_and_other_names_are_no_recordings(tmp_path: Path) -> None:
    (tmp_path / "light.h5").touch()
    (tmp_path / "link.h5").symlink_to(tmp_path / "light.h5")
    (tmp_path / "linked.h5.part").symlink_to(tmp_path / "light.h5")
    (tmp_path / ".hidden.h5").touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "folder.h5").mkdir()

    assert Directory(tmp_path).ids() == {"light"}


@pytest.mark.parametrize(
    ("name", "is_id"),
    [
        ("a", True),
        ("0", True),
        ("a_b-c", True),
        ("x" * 128, True),
        ("x" * 129, False),
        ("-a", False),
        ("_a", False),
        ("a.b", False),
        ("a b", False),
        ("ä", False),
        ("", False),
    ],
)
def test_files_are_recordings_where_their_names_are_ids(
    tmp_path: Path, name: str, *, is_id: bool
) -> None:
    directory = Directory(tmp_path)
    for suffix in (".h5", ".h5.part"):
        (tmp_path / (name + suffix)).touch()

    assert directory.ids() == ({name} if is_id else set())
    assert (directory.find(name) == directory.new(name)) == is_id  # the finished one first


def test_a_directory_is_made_with_those_above_it(tmp_path: Path) -> None:
    directory = Directory(tmp_path / "a" / "b")
    assert directory.files() == []
    with pytest.raises(FileNotFoundError):
        directory.free_bytes()

    for _ in range(2):
        directory.make()

    assert directory.free_bytes() > 0
    assert directory.new("c") == tmp_path / "a" / "b" / "c.h5"


def test_all_files_of_a_recording_are_deleted_and_no_other(tmp_path: Path) -> None:
    for name in ("a.h5", "a.h5.part", "a.h5.scratch", "b.h5", "a.h5.kept"):
        (tmp_path / name).touch()

    Directory(tmp_path).remove("a")

    assert {each.name for each in tmp_path.iterdir()} == {"b.h5", "a.h5.kept"}
    Directory(tmp_path).remove("a")


def test_what_is_written_is_not_deleted(tmp_path: Path) -> None:
    (tmp_path / "a.h5").touch()
    with lock.create(tmp_path / "a.h5.part"), pytest.raises(RecordingInUse):
        Directory(tmp_path).remove("a")

    assert {each.name for each in tmp_path.iterdir()} == {"a.h5", "a.h5.part"}
