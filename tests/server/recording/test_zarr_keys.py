"""A recording as a Zarr store, held against HDF5 and zarr-python."""

import json
import zlib
from pathlib import Path

import h5py
import numcodecs
import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from tests.server.recording.made import frame, header, record
from transientcam_server.errors import DamagedFrame
from transientcam_server.imaging import Column
from transientcam_server.recording import Recording, RecordingWriter, ZarrKeys
from transientcam_server.recording._storage import place_of_chunk

FRAMES = 3
pytestmark = pytest.mark.usefixtures("zarr_clients")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("zarr") / "a.h5", FRAMES, annotations={"a": 1})


def test_a_chunk_is_what_hdf5_stored_and_ends_where_the_deflated_data_end(source: Path) -> None:
    with Recording(source) as recording, h5py.File(source) as file:
        sent = ZarrKeys(recording).value("raw/1.0.0.0")
        _, stored = file["raw"].id.read_direct_chunk((1, 0, 0, 0))

    assert stored.startswith(sent)
    inflating = zlib.decompressobj()
    shuffled = inflating.decompress(sent)
    assert inflating.eof
    assert inflating.unused_data == b""  # some readers refuse bytes behind the end
    values = numcodecs.Shuffle(2).decode(shuffled)
    np.testing.assert_array_equal(np.frombuffer(values, "<u2"), frame(1).images.ravel())


def test_consolidated_metadata_has_every_other_document(source: Path) -> None:
    with Recording(source) as recording:
        keys = ZarrKeys(recording)
        consolidated = json.loads(keys.value(".zmetadata"))
        for key, document in consolidated["metadata"].items():
            assert json.loads(keys.value(key)) == document
        arrays = {key.partition("/")[0] for key in keys.metadata if "/" in key}

    assert {".zgroup", ".zattrs"} <= consolidated["metadata"].keys()
    with h5py.File(source) as file:
        # two are attributes of the group, one is an axis without values; one follows from others
        assert arrays - {"captured_unix_s"} == file.keys() - {"annotations", "end", "sub_phase"}


def test_documents_state_the_versions_of_the_specification(source: Path) -> None:
    with Recording(source) as recording:
        keys = ZarrKeys(recording)
        consolidated = json.loads(keys.value(".zmetadata"))
        images = json.loads(keys.value("raw/.zarray"))
        others = [json.loads(keys.value(f"{name}/.zarray")) for name in ("frame", "kind")]

    assert consolidated["zarr_consolidated_format"] == 1
    assert consolidated["metadata"][".zgroup"] == {"zarr_format": 2}
    assert images == {
        "zarr_format": 2,
        "shape": [FRAMES, *frame(0).images.shape],
        "chunks": [1, *frame(0).images.shape],
        "dtype": "<u2",
        "filters": [{"id": "shuffle", "elementsize": 2}],
        "compressor": {"id": "zlib", "level": 1},
        "fill_value": None,
        "order": "C",
    }
    for each in others:
        assert (each["zarr_format"], each["fill_value"], each["order"]) == (2, None, "C")
        assert (each["filters"], each["compressor"]) == (None, None)


@pytest.mark.parametrize(("rows", "count"), [(0, 0), (1, 1), (1024, 1), (1025, 2), (2048, 2)])
def test_a_long_series_is_in_chunks_of_1024_of_which_the_last_is_filled(
    source: Path, rows: int, count: int
) -> None:
    values = np.arange(1, rows + 1, dtype="<i4")
    with Recording(source) as recording:
        keys = ZarrKeys(recording)
        keys.__dict__["_columns"] = {"long": Column(("frame",), values)}
        names = list(keys.small())
        read = [np.frombuffer(keys.value(name), "<i4") for name in names]
        with pytest.raises(KeyError):
            keys.value(f"long/{count}")

    assert names == [f"long/{number}" for number in range(count)]
    assert all(len(each) == 1024 for each in read)
    padded = np.zeros(1024 * count, "<i4")
    padded[:rows] = values
    np.testing.assert_array_equal(np.concatenate([np.empty(0, "<i4"), *read]), padded)


def unpacked(recording: Recording, into: Path) -> zarr.Group:
    """Return a store of files with every key, opened by zarr."""
    keys = ZarrKeys(recording)
    chunks = recording.stored.chunks or (1, *recording.shape[1:])
    counts = [-(-size // chunk) for size, chunk in zip(recording.shape, chunks, strict=True)]
    images = ["raw/" + ".".join(map(str, numbers)) for numbers in np.ndindex(*counts)]
    for key in (*keys.metadata, ".zmetadata", *keys.small(), *images):
        place = into / key
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(keys.value(key))
    return zarr.open_group(str(into), mode="r", zarr_format=2)


@pytest.mark.parametrize(
    "options",
    [
        {"chunks": (2, 5, 7, 16), "shuffle": True, "compression": "gzip"},
        {"chunks": (1, 8, 12, 16), "compression": "gzip"},
        {"chunks": (2, 8, 12, 16)},
        {},
        {"dtype": ">u2", "chunks": (1, 8, 12, 16), "shuffle": True, "compression": "gzip"},
    ],
    ids=["cut", "deflated", "plain", "in one piece", "big-endian"],
)
def test_files_that_were_repacked_are_read_as_they_are(
    source: Path, tmp_path: Path, options: dict[str, object]
) -> None:
    packed = tmp_path / "packed.h5"
    with h5py.File(source) as file, h5py.File(packed, "w") as other:
        other.attrs.update(file.attrs)
        for name in file.keys() - {"raw"}:
            file.copy(name, other)
        other.create_dataset("raw", data=file["raw"][()], **options)

    with Recording(packed) as recording:
        group = unpacked(recording, tmp_path / "store")

    expected: NDArray[np.uint16] = np.stack([frame(number).images for number in range(FRAMES)])
    np.testing.assert_array_equal(np.asarray(group["raw"]), expected)


@pytest.mark.parametrize("complete", [False, True])
def test_every_value_is_that_of_the_file_also_while_it_is_written(
    tmp_path: Path, complete: bool
) -> None:
    path = tmp_path / "a.h5"
    writer = RecordingWriter(path, header())
    try:
        for number in range(FRAMES):
            writer.append(frame(number))
        if complete:
            writer.close({"reason": "stopped"})
        with Recording(path if complete else path.with_name("a.h5.part")) as recording:
            group = unpacked(recording, tmp_path / "store")
    finally:
        if not complete:
            writer.close({"reason": "stopped"})

    with h5py.File(path) as file:
        for name, array in group.arrays():
            if name == "captured_unix_s":  # which follows from others
                continue
            np.testing.assert_array_equal(np.asarray(array), file[name][()], err_msg=name)


def test_a_chunk_of_a_series_keeps_its_size_while_a_recording_grows(source: Path) -> None:
    with Recording(source) as recording:
        chunk = ZarrKeys(recording).value("frame/0")

    assert len(chunk) == 1024 * 8
    np.testing.assert_array_equal(np.frombuffer(chunk, "<u8")[: FRAMES + 1], [1, 2, 3, 0])


@pytest.mark.parametrize(
    "key",
    [
        "",
        ".zarray",
        "raw",
        "raw/",
        "raw/3.0.0.0",
        "raw/0.0.0",
        "raw/0.0.0.0.0",
        "raw/00.0.0.0",
        "raw/-1.0.0.0",
        "raw/٠.0.0.0",
        "raw/0.0.0.99999999999999999999",
        "frame/1",
        "frame/0.0",
        "no/0",
        "../a.h5",
    ],
)
def test_where_nothing_stands_there_is_no_key(source: Path, key: str) -> None:
    with Recording(source) as recording, pytest.raises(KeyError):
        ZarrKeys(recording).value(key)


def test_a_chunk_that_is_said_to_lie_behind_the_end_is_not_looked_for(source: Path) -> None:
    with h5py.File(source) as file:
        raw = file["raw"]
        offset, size = place_of_chunk(raw, (1, 0, 0, 0), source.stat().st_size)
        with pytest.raises(ValueError, match="outside of the file"):
            place_of_chunk(raw, (1, 0, 0, 0), offset + size - 1)


def test_a_chunk_that_was_never_written_is_damaged_and_not_empty(
    source: Path, tmp_path: Path
) -> None:
    sparse = tmp_path / "sparse.h5"
    with h5py.File(source) as file, h5py.File(sparse, "w") as other:
        other.attrs.update(file.attrs)
        for name in file.keys() - {"raw"}:
            file.copy(name, other)
        shape = file["raw"].shape
        other.create_dataset("raw", shape, "<u2", chunks=(1, *shape[1:]), compression="gzip")

    with Recording(sparse) as recording, pytest.raises(DamagedFrame, match="never written"):
        ZarrKeys(recording).value("raw/2.0.0.0")
