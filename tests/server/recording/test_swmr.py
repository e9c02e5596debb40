"""Chunks as HDF5's filters make them, and what errors say of them."""

import errno
import os
import zlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from transientcam_server.recording import swmr

BLOCK = np.arange(24, dtype="<u2").reshape(2, 3, 4) * 257


def test_a_block_is_shuffled_by_bytes_and_deflated() -> None:
    low, high = (BLOCK % 256).astype("u1"), (BLOCK // 256).astype("u1")

    assert zlib.decompress(swmr.compressed(BLOCK)) == low.tobytes() + high.tobytes()


@pytest.mark.parametrize("dtype", ["<u2", "<f8", "|u1"])
def test_a_chunk_expands_to_its_block(dtype: str) -> None:
    block = BLOCK.astype(dtype)
    chunk = swmr.compressed(block)

    np.testing.assert_array_equal(swmr.expanded(chunk, block.shape, block.dtype), block)
    plain = zlib.compress(block.tobytes())
    np.testing.assert_array_equal(
        swmr.expanded(plain, block.shape, block.dtype, shuffled=False), block
    )


@pytest.mark.parametrize(
    "chunk",
    [
        b"",
        b"no deflate",
        swmr.compressed(BLOCK)[:-1],
        zlib.compress(bytes(47)),
        zlib.compress(bytes(49)),
        zlib.compress(bytes(10**6)),
    ],
    ids=["nothing", "no deflate", "cut", "47 bytes", "49 bytes", "a million"],  # not by their bytes
)
def test_a_chunk_of_another_size_is_damage(chunk: bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011  (zlib's own words, or ours)
        swmr.expanded(chunk, BLOCK.shape, BLOCK.dtype)


def test_a_seal_behind_a_chunk_is_not_expanded() -> None:
    np.testing.assert_array_equal(
        swmr.expanded(swmr.compressed(BLOCK) + b"seal", BLOCK.shape, BLOCK.dtype), BLOCK
    )


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (OSError(errno.ENOSPC, "Can't write (file write failed, errno = 28, ..."), None),
        (OSError("no number\nand more"), "no number"),
        (ValueError("first line\nsecond line"), "first line"),
        (ValueError(""), ""),
        (OSError(errno.EIO, None), ""),
    ],
)
def test_an_error_is_told_in_the_systems_words(error: Exception, words: str | None) -> None:
    assert swmr.in_words(error) == (os.strerror(errno.ENOSPC) if words is None else words)


@pytest.fixture
def appender(tmp_path: Path) -> Any:
    path = tmp_path / "a.h5"

    def make(file: swmr.File) -> None:
        swmr.create_blocks(file, "raw", (3, 4), "<u2", unit="DN")
        swmr.create_series(file, "row", "<u8")

    path.write_bytes(swmr.image_of(make))
    return swmr.Appender(path, ["raw"], ["row"])


def test_a_file_is_brought_to_the_disk_once_a_second(
    appender: swmr.Appender, monkeypatch: pytest.MonkeyPatch
) -> None:
    times: list[float] = []
    now_s = 0.0
    monkeypatch.setattr(os, "fsync", lambda _: times.append(now_s))

    for now_s in (5.0, 5.5, 5.999, 6.0, 6.9, 7.1, 9.0):
        appender.synchronise(now_s)

    assert times == [5.0, 6.0, 7.1, 9.0]
    appender.close()


def test_rows_follow_one_another_also_of_a_file_that_is_opened_again(
    appender: swmr.Appender, tmp_path: Path
) -> None:
    for row in range(3):
        assert appender.rows == row
        appender.append({"raw": BLOCK[0] + row}, {"row": 7 + row})
    assert appender.size_bytes == (tmp_path / "a.h5").stat().st_size
    appender.close()

    with h5py.File(tmp_path / "a.h5") as file:
        assert file["row"][()].tolist() == [7, 8, 9]
        np.testing.assert_array_equal(file["raw"][2], BLOCK[0] + 2)
        assert file["raw"].chunks == (1, 3, 4)
        assert file["raw"].maxshape == (None, 3, 4)
        assert dict(file["raw"].attrs) == {"unit": "DN"}
    again = swmr.Appender(tmp_path / "a.h5", ["raw"], ["row"])
    assert again.rows == 3
    again.close()
