import errno
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import pytest

from tests.server.recording import children
from tests.server.recording.made import assert_same, record
from transientcam_compiled import ChildProcess
from transientcam_server.errors import Problem
from transientcam_server.recording import Recording, _uploads as uploads
from transientcam_server.recording._directory import Directory
from transientcam_server.recording._uploads import Upload, rewrite
from transientcam_server.settings import RecordingSettings

FRESH = "20300101T000000Z-000000"
AMPLE_BYTES = 2**40


@pytest.fixture(scope="module")
def child() -> Iterator[ChildProcess]:
    made = ChildProcess()
    yield made
    made.end()


@pytest.fixture
def original(tmp_path: Path) -> Path:
    return record(tmp_path / "original.h5", 4, annotations={"sample": "wax"})


def upload(directory: Path, **settings: Any) -> Upload:
    chosen = RecordingSettings(directory=directory, **{"min_free_bytes": 0} | settings)
    return Upload(Directory(directory), chosen, FRESH, 0)


def written(child: ChildProcess, sent: Path, *, most: int = AMPLE_BYTES, least: int = 0) -> Path:
    """Have a file written anew; return where."""
    anew = sent.with_name("anew.h5")
    child.call(rewrite, sent, anew, FRESH, most, least, ask=lambda: None)
    return anew


def test_what_is_written_anew_is_the_recording_that_was_sent(
    child: ChildProcess, original: Path
) -> None:
    with Recording(original) as sent, Recording(written(child, original)) as anew:
        for got, wanted in zip(anew, sent, strict=True):
            assert_same(got, wanted)
        assert anew.header == sent.header
        assert (anew.annotations, anew.end) == (sent.annotations, sent.end)
        for name in ("dropped_frames", "crc32", "device_frame"):
            assert anew.series(name).tolist() == sent.series(name).tolist()


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-3000])


def text(path: Path) -> None:
    path.write_text("no HDF5 at all")


def other(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["raw"] = [1, 2, 3]


def torn(path: Path) -> None:
    with h5py.File(path, "r") as file:
        place = file["raw"].id.get_chunk_info(2)
    with path.open("r+b") as stream:
        stream.seek(place.byte_offset + place.size // 2)
        stream.write(bytes(64))


@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (cut, "truncated file"),
        (text, "signature not found"),
        (other, "no attribute format"),
        (torn, "frame 3 is damaged"),
    ],
)
def test_what_is_no_whole_recording_is_refused_by_what_is_wrong(
    child: ChildProcess, original: Path, harm: Any, reason: str
) -> None:
    harm(original)

    with pytest.raises(ValueError, match=reason) as refused:
        written(child, original)

    assert str(original.parent) not in str(refused.value)  # where it lies is nobody's business


def test_it_is_written_no_longer_than_allowed_and_leaves_the_disk_its_reserve(
    original: Path,
) -> None:
    child = ChildProcess()  # a limit holds for the rest of a process
    try:
        with pytest.raises(OSError, match="have to stay so") as full:
            written(child, original, least=2**62)
        with pytest.raises(OSError, match="File too large") as large:
            written(child, original, most=original.stat().st_size // 2)
    finally:
        child.end()

    assert (full.value.errno, large.value.errno) == (errno.ENOSPC, errno.EFBIG)


@pytest.mark.parametrize(
    ("instead", "kind", "reason"),
    [
        (children.crash, "invalid-recording", "the process that read it has ended"),
        (children.hang, "invalid-recording", "it was not read within 0 s"),
        (children.lie, "recording-not-stored", "another recording has its id"),
    ],
)
def test_whatever_the_other_process_does_nothing_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, instead: Any, kind: str, reason: str
) -> None:
    monkeypatch.setattr(uploads, "rewrite", instead)
    if instead is children.hang:
        monkeypatch.setattr(uploads, "_START_S", 0.0)
    sent = upload(tmp_path / "kept")
    sent.write(b"anything")

    with pytest.raises(Problem, match=reason) as refused:
        sent.take_in(lambda: None)
    sent.close()

    assert refused.value.kind.slug == kind
    assert [each for each in (tmp_path / "kept").iterdir() if each.name != "hanging"] == []


def test_a_full_disk_refuses_what_is_announced_and_what_comes_unannounced(tmp_path: Path) -> None:
    directory = Directory(tmp_path)
    full = RecordingSettings(directory=tmp_path, min_free_bytes=2**62)
    free = RecordingSettings(directory=tmp_path, min_free_bytes=0, max_upload_bytes=2**63)
    with pytest.raises(Problem, match="have to stay so"):
        Upload(directory, full, FRESH, 0)
    with pytest.raises(Problem, match="are wanted"):
        Upload(directory, free, FRESH, 2**62)

    sent = Upload(directory, free, FRESH, 0)
    vars(free)["min_free_bytes"] = 2**62  # others have filled the disk meanwhile
    with pytest.raises(Problem, match="have to stay so"):
        sent.write(b"more")
    sent.close()

    assert list(tmp_path.iterdir()) == []
