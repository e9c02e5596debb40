"""Heaps of texts that lead nowhere: without a look at them first, HDF5 never comes back."""

import io
from pathlib import Path

import pytest

from tests.server.recording.made import record
from transientcam_server.errors.exceptions import NotARecording
from transientcam_server.recording import Recording, recover
from transientcam_server.recording.heaps import require_sound_heaps


def heap(*objects: tuple[int, int, int], size: int = 4096) -> io.BytesIO:
    """Return a file with a heap: of each object its index, the size it states, and its bytes."""
    data = b"GCOL\1\0\0\0" + size.to_bytes(8, "little")
    for index, stated, length in objects:
        head = index.to_bytes(2, "little") + bytes(6) + stated.to_bytes(8, "little")
        data += head + bytes(length)
    return io.BytesIO(b"before" + data.ljust(size, b"\xff"))


SOUND = {
    "one text": [(1, 10, 16), (0, 4096 - 48, 4096 - 64)],
    "full": [(1, 4096 - 32, 4096 - 32)],
    "too little is left for another": [(1, 4096 - 40, 4096 - 40)],
    "an empty text": [(1, 0, 0), (0, 4096 - 32, 0)],
}
DAMAGED = {
    "no size": [(1, 10, 16), (0, 0, 0)],
    "beyond the heap": [(1, 5000, 0)],
    "beyond all numbers": [(1, 2**64 - 1, 0)],
    "free space beyond the heap": [(0, 2**63, 0)],
}


@pytest.mark.parametrize("name", SOUND)
def test_objects_that_follow_one_another_are_sound(name: str) -> None:
    require_sound_heaps(heap(*SOUND[name]))


@pytest.mark.parametrize("name", DAMAGED)
def test_objects_that_lead_nowhere_are_damage(name: str) -> None:
    with pytest.raises(ValueError, match="heap of texts at 6"):
        require_sound_heaps(heap(*DAMAGED[name]))


@pytest.mark.timeout(60)
def test_a_recording_of_which_a_sector_was_lost_is_no_recording(tmp_path: Path) -> None:
    path = record(tmp_path / "torn.h5", 2)
    with Recording(path) as whole:
        assert whole.frames == 2
    data = bytearray(path.read_bytes())
    at = data.index(b"GCOL")
    data[at + 64 : at + 576] = bytes(512)
    path.write_bytes(data)

    with pytest.raises(NotARecording, match="heap"):
        Recording(path)
    part = path.rename(path.with_name("torn.h5.part"))
    with pytest.raises(NotARecording, match="heap"):
        recover(part)
