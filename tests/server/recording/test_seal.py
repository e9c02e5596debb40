"""Seals behind chunks: frames are found by them alone, and only whole ones."""

import zlib
from pathlib import Path
from typing import Any

import pytest

from transientcam_server.recording._layout import SERIES
from transientcam_server.recording._seal import SIZE_BYTES, seal, sealed_frames, unsealed_size

FIGURES: dict[str, Any] = {
    name: (row + 0.5 if kind == "<f8" else row)
    for row, (name, (kind, _)) in enumerate(SERIES.items())
}
MAGIC = bytes.fromhex("7f5d0a1ae3c14b9f8e62d00dfeed5ea1")


def sealed(row: int, chunk: bytes) -> bytes:
    return chunk + seal(row, chunk, FIGURES | {"device_frame": row})


def found(path: Path, data: bytes) -> list[tuple[int, bytes]]:
    """Frames of a file: the number of each, and its bytes."""
    path.write_bytes(data)
    return [
        (each.values["device_frame"], data[each.offset : each.offset + each.size])
        for each in sealed_frames(path)
    ]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "a"


def test_a_seal_has_mark_row_size_figures_and_checksum_in_this_order() -> None:
    chunk = b"a chunk"

    data = seal(3, chunk, FIGURES)

    assert len(data) == SIZE_BYTES
    assert data[:16] == MAGIC
    assert data[16:32] == (3).to_bytes(8, "little") + len(chunk).to_bytes(8, "little")
    assert data[-4:] == zlib.crc32(chunk + data[:-4]).to_bytes(4, "little")


def test_frames_are_found_in_the_order_of_their_rows_wherever_they_are(path: Path) -> None:
    chunks = [b"first", b"", b"third" * 9]
    one, two, three = (sealed(row, chunk) for row, chunk in enumerate(chunks))

    assert found(path, b"head" + three + b"between" + one + two + b"tail") == [*enumerate(chunks)]
    path.write_bytes(one)
    assert sealed_frames(path)[0].values == FIGURES | {"device_frame": 0}


def test_frames_stop_before_the_first_row_that_is_missing(path: Path) -> None:
    rows = [sealed(row, bytes([row] * 5)) for row in range(4)]

    assert [row for row, _ in found(path, rows[0] + rows[1] + rows[3])] == [0, 1]
    assert found(path, rows[1] + rows[2]) == []


def test_a_file_without_frames_has_none(path: Path) -> None:
    assert found(path, b"") == []
    assert found(path, b"no seal") == []
    assert found(path, MAGIC) == []


def test_any_damage_takes_a_frame_and_leaves_those_before(path: Path) -> None:
    first, second = sealed(0, b"first"), sealed(1, b"second")
    whole = first + second
    for at in range(len(first), len(whole)):
        damaged = bytearray(whole)
        damaged[at] ^= 1
        assert found(path, bytes(damaged)) == [(0, b"first")]
        assert found(path, whole[:at]) == [(0, b"first")]


def test_a_size_that_reaches_before_the_file_is_no_frame(path: Path) -> None:
    assert found(path, sealed(0, b"chunk")[1:]) == []
    assert found(path, sealed(0, b"chunk")) == [(0, b"chunk")]


def test_a_frame_whose_chunk_has_a_mark_in_it_is_found(path: Path) -> None:
    chunks = [b"before" + MAGIC + b"behind", MAGIC * 3, MAGIC]

    data = b"".join(sealed(row, chunk) for row, chunk in enumerate(chunks))

    assert found(path, data) == [*enumerate(chunks)]


@pytest.mark.parametrize("length", [0, 1, 1000])
def test_the_compressed_part_of_a_chunk_is_what_is_before_its_seal(length: int) -> None:
    data = sealed(0, bytes(length))

    assert unsealed_size(len(data), data[-SIZE_BYTES:]) == length
    assert unsealed_size(len(data) + 1, data[-SIZE_BYTES:]) == length + SIZE_BYTES + 1
    for plain in (bytes(SIZE_BYTES), b"", data[-SIZE_BYTES:][1:]):
        assert unsealed_size(500, plain) == 500
