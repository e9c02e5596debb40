"""What the service keeps of recordings, beside their files."""

from pathlib import Path

import pytest

from tests.server.recording.made import header, record
from transientcam_server.errors.exceptions import Problem
from transientcam_server.recording import Header, layout
from transientcam_server.recording.descriptions import Descriptions
from transientcam_server.recording.library import Library
from transientcam_server.settings import RecordingSettings

IDS = [f"20261120T08150{number}Z-3f9c2a" for number in range(4)]


@pytest.fixture
def library(tmp_path: Path) -> Library:
    """One with a few recordings that others have made."""
    for each in IDS:
        record(tmp_path / f"{each}{layout.SUFFIX}", 2, recording_id=each)

    def new_header(recording_id: str, name: str, started_s: float) -> Header:
        return header(recording_id=recording_id, name=name, started_s=started_s)

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
