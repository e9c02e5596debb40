"""The files of recordings, found while others are written and finished."""

from collections.abc import Iterator
from pathlib import Path

import pytest

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
