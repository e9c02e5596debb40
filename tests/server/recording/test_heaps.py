"""Heaps of texts that lead nowhere: without a look at them first, HDF5 never comes back."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import IO

import numpy as np
import pytest

from tests.server.recording.made import frame, record, rewrite_texts_at_the_end
from transientcam_server.errors import NotARecording
from transientcam_server.recording import Recording, recover, require_sound_heaps
from transientcam_server.recording._heaps import MAX_HEAP_BYTES, CheckedReader


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


def byte_by_byte(stream: IO[bytes]) -> None:
    """Read a file in the smallest pieces."""
    reader = CheckedReader(stream)
    while reader.read(1):
        pass


READERS: dict[str, Callable[[IO[bytes]], object]] = {
    "all at once": require_sound_heaps,
    "as it is read": lambda stream: CheckedReader(stream).read(),
    "byte by byte": byte_by_byte,
}
by_all_readers = pytest.mark.parametrize("read", READERS.values(), ids=READERS)


@by_all_readers
@pytest.mark.parametrize("name", SOUND)
def test_objects_that_follow_one_another_are_sound(
    name: str, read: Callable[[IO[bytes]], object]
) -> None:
    read(heap(*SOUND[name]))


@by_all_readers
@pytest.mark.parametrize("name", DAMAGED)
def test_objects_that_lead_nowhere_are_damage(
    name: str, read: Callable[[IO[bytes]], object]
) -> None:
    with pytest.raises(ValueError, match="heap of texts at 6"):
        read(heap(*DAMAGED[name]))


@by_all_readers
@pytest.mark.parametrize("size", [MAX_HEAP_BYTES + 8, 10**9])
def test_a_heap_larger_than_any_text_or_the_file_is_damage(
    size: int, read: Callable[[IO[bytes]], object]
) -> None:
    torn = heap((1, 10, 16)).getvalue()
    stated = torn[:14] + size.to_bytes(8, "little") + torn[22:]
    with pytest.raises(ValueError, match="heap of texts at 6"):
        read(io.BytesIO(stated))


@by_all_readers
@pytest.mark.parametrize(("size", "damaged"), [(2**40 - 1, True), (2**40, False)])
def test_a_size_that_no_memory_has_is_that_of_no_heap(
    size: int, read: Callable[[IO[bytes]], object], *, damaged: bool
) -> None:
    stream = io.BytesIO(b"GCOL\1\0\0\0" + size.to_bytes(8, "little") + bytes(100))

    if damaged:
        with pytest.raises(ValueError, match="heap of texts at 0"):
            read(stream)
    else:
        read(stream)


@pytest.mark.parametrize("read", [require_sound_heaps, READERS["as it is read"]])
def test_the_largest_heap_is_sound(read: Callable[[IO[bytes]], object]) -> None:
    assert MAX_HEAP_BYTES == 16 * 1024**2

    read(heap((1, MAX_HEAP_BYTES - 32, MAX_HEAP_BYTES - 32), size=MAX_HEAP_BYTES))


@pytest.mark.parametrize("before", range(7))
def test_heaps_are_found_where_a_file_is_read_in_two_pieces(before: int) -> None:
    at = 4 * 1024**2 - before
    torn = heap((1, 10, 16), (0, 0, 0)).getvalue()[6:]

    with pytest.raises(ValueError, match=f"heap of texts at {at} is damaged"):
        require_sound_heaps(io.BytesIO(bytes(at) + torn))


@by_all_readers
def test_each_of_several_heaps_is_looked_at(read: Callable[[IO[bytes]], object]) -> None:
    sound = heap(*SOUND["full"]).getvalue()
    torn = heap(*DAMAGED["no size"]).getvalue()

    read(io.BytesIO(sound + sound))
    with pytest.raises(ValueError, match=f"heap of texts at {len(sound) + 6} is damaged"):
        read(io.BytesIO(sound + torn))


@by_all_readers
def test_data_that_begin_like_a_heap_of_no_possible_size_are_none(
    read: Callable[[IO[bytes]], object],
) -> None:
    read(io.BytesIO(b"GCOL\1" + bytes(range(200, 256))))


def test_what_is_read_is_what_the_file_holds() -> None:
    data = np.random.default_rng(1).bytes(10_000)
    reader = CheckedReader(io.BytesIO(data))
    assert reader.readable()
    assert reader.seekable()
    assert reader.seek(-100, io.SEEK_END) == 9900
    assert reader.read(1000) == data[9900:]
    assert reader.seek(-50, io.SEEK_CUR) == 9950
    assert reader.tell() == 9950
    assert reader.read(7) == data[9950:9957]


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


@pytest.mark.timeout(60)
@pytest.mark.parametrize("suffix", [".h5", ".h5.part"])
def test_a_damaged_heap_behind_all_data_makes_no_recording(tmp_path: Path, suffix: str) -> None:
    path = record(tmp_path / "far.h5", 2)
    rewrite_texts_at_the_end(path)
    at = path.read_bytes().rindex(b"GCOL\1")
    assert at > 3 * 1024**2
    path = path.rename(tmp_path / f"far{suffix}")
    with Recording(path) as whole:
        assert whole.header.name == "rewritten"
        np.testing.assert_array_equal(whole.frame(1).images, frame(1).images)

    data = bytearray(path.read_bytes())
    data[at + 16 : at + 4096] = bytes(4080)
    path.write_bytes(data)

    with pytest.raises(NotARecording, match=f"heap of texts at {at}"):
        Recording(path)
    with path.open("rb") as stream, pytest.raises(NotARecording, match="heap of texts"):
        Recording(Path("elsewhere"), source=stream)
