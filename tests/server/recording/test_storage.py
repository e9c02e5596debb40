"""What a file states about its sizes, and what that may cost."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import pytest

from tests.server.fuzzing.damage import checked_blocks, lookup3
from transientcam_server.recording._storage import Storage, is_one_chunk_a_row, read_rows

LISTED = """
import resource, sys
from pathlib import Path
from transientcam_server.recording import Library
from transientcam_server.settings import RecordingSettings

directory = Path(sys.argv[1])
library = Library(RecordingSettings(directory=directory), header=lambda *given: None)
resource.setrlimit(resource.RLIMIT_DATA, (1800 << 20, 1800 << 20))  # as LimitDATA= of the service
(listed,) = library.describe_all()
# not ru_maxrss, which begins with that of the process that was forked
status = Path("/proc/self/status").read_text()
peak_kb = int(status.split("VmHWM:")[1].split()[0])
print(listed["state"], peak_kb < 1 << 20)
"""


def test_a_text_that_states_a_length_of_4_gib_takes_no_memory_where_that_is_limited(
    tmp_path: Path,
) -> None:
    path = tmp_path / "forged.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["format"] = "x" * 349
    data = bytearray(path.read_bytes())
    at = data.index((349).to_bytes(4, "little"))
    for begin, end in checked_blocks(bytes(data)):
        if begin <= at < end:
            data[at : at + 4] = b"\xf0\xff\xff\xff"
            data[end : end + 4] = lookup3(bytes(data[begin:end])).to_bytes(4, "little")
    path.write_bytes(data)

    result = subprocess.run(
        [sys.executable, "-c", LISTED, str(tmp_path)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )

    assert result.stdout.split() == ["damaged", "True"]


@pytest.mark.parametrize(
    ("chunks", "filters", "expected"),
    [
        ((1, 4, 5), {"shuffle": True, "compression": "gzip"}, True),
        ((1, 4, 5), {"compression": "gzip"}, False),
        ((1, 4, 5), {}, False),
        ((2, 4, 5), {"shuffle": True, "compression": "gzip"}, False),
        ((1, 2, 5), {"shuffle": True, "compression": "gzip"}, False),
    ],
)
def test_blocks_are_a_shuffled_and_deflated_chunk_a_row(
    tmp_path: Path, chunks: tuple[int, ...], filters: dict[str, Any], *, expected: bool
) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("raw", (3, 4, 5), "<u2", chunks=chunks, **filters)

        assert is_one_chunk_a_row(Storage(file, 10**9).dataset("raw")) == expected


@pytest.mark.parametrize(("rows", "readable"), [(4096, True), (4097, False)])
def test_so_many_chunks_are_read_at_once(tmp_path: Path, rows: int, *, readable: bool) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("many", (rows,), "|u1", chunks=(1,))
        storage = Storage(file, 10**9)

        if readable:
            assert storage.values("many").tolist() == [0] * rows
        else:
            with pytest.raises(ValueError, match="stored in 4097 chunks, more than 4096"):
                storage.values("many")
        dataset = storage.dataset("many")
        assert len(read_rows(dataset, 1, 4097)) == rows - 1


@pytest.mark.parametrize(
    ("file_bytes", "allowed"), [(0, 16 * 1024**2), (10**6, 16 * 1024**2), (2 * 10**7, 2 * 10**7)]
)
def test_no_more_is_read_than_the_file_holds_or_16_mebibytes(
    tmp_path: Path, file_bytes: int, allowed: int
) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("half", (allowed - 100,), "|u1", chunks=(2**20,))  # never written
        file.create_dataset("rest", (100,), "|u1")
        file.create_dataset("more", (1,), "|u1")
        storage = Storage(file, file_bytes)

        assert storage.values("half").size == allowed - 100
        assert storage.values("rest").size == 100
        with pytest.raises(ValueError, match="more states a size of 1 bytes"):
            storage.values("more")


@pytest.mark.parametrize(("mebibytes", "readable"), [(256, True), (257, False)])
def test_a_chunk_has_256_mebibytes_at_most(
    tmp_path: Path, mebibytes: int, *, readable: bool
) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("one", (1024, 2**20), "|u1", chunks=(mebibytes, 2**20))
        storage = Storage(file, 10**9)

        if readable:
            assert storage.dataset("one").chunks == (256, 2**20)
        else:
            with pytest.raises(ValueError, match="chunks of more than 268435456 bytes"):
                storage.dataset("one")
