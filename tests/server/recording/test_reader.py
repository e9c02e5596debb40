import json
import threading
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from h5py._objects import phil
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as of_numpy
from isal import isal_zlib

from tests.server.recording.made import (
    APPLIED,
    CAPABILITIES,
    HEIGHT,
    WIDTH,
    assert_same,
    frame,
    header,
    record,
)
from transientcam_driver import RawFrame
from transientcam_server.errors import DamagedFrame, NotARecording
from transientcam_server.recording import (
    DiskFile,
    Recording,
    RecordingWriter,
    _disk as disk,
    _layout as recording_layout,
    swmr,
)
from transientcam_server.recording._directory import Directory

SHAPE = (APPLIED.images, HEIGHT, WIDTH)


def test_every_frame_comes_back_bit_for_bit(tmp_path: Path) -> None:
    with Recording(record(tmp_path / "a.h5", 5)) as recording:
        frames = list(recording)

    assert len(frames) == 5
    for number, got in enumerate(frames):
        assert_same(got, frame(number))


def test_what_was_known_before_the_first_frame_comes_back(tmp_path: Path) -> None:
    with Recording(record(tmp_path / "a.h5", 1, annotations={"who": "Åsa"})) as recording:
        assert recording.header == header()
        assert recording.labels == APPLIED.labels
        assert recording.annotations == {"who": "Åsa"}
        assert recording.end["reason"] == "stopped"


def test_what_is_written_in_place_has_the_same_room_in_every_file(tmp_path: Path) -> None:
    # another release replaces these bytes: more of them would reach into what lies behind
    with h5py.File(record(tmp_path / "a.h5", 1), "r") as file:
        assert file["annotations"].dtype.itemsize == 16384
        assert file["end"].dtype.itemsize == 4096


def test_a_calibration_of_every_pixel_travels_along(tmp_path: Path) -> None:
    planes = np.exp(1j * np.arange(3 * HEIGHT * WIDTH)).reshape(3, HEIGHT, WIDTH)
    about = {"id": "c", "temperature_c": 31.25}
    path = record(
        tmp_path / "a.h5", 1, calibration_planes=planes.astype(np.complex64), calibration=about
    )

    with Recording(path) as recording:
        found = recording.header.gains

    assert found is not None
    np.testing.assert_array_equal(found.planes, planes.astype(np.complex64))
    assert (found.id, found.temperature_c) == ("c", 31.25)
    with h5py.File(path) as file:
        for name in ("gain", "weight"):
            parts = file[f"{name}_re"][()], file[f"{name}_im"][()]
            assert parts[0].dtype.kind == "f"
            np.testing.assert_array_equal(parts[0] + 1j * parts[1], file[name][()])
        assert file["gain_im"].dims[1].keys() == ["y"]


def test_times_of_a_clock_that_ptp_disciplines_are_those_of_captures(tmp_path: Path) -> None:
    disciplined = replace(CAPABILITIES, clock="ptp")

    with Recording(record(tmp_path / "a.h5", 3, capabilities=disciplined)) as recording:
        np.testing.assert_array_equal(recording.captured_unix_s, recording.series("device_time_s"))
        assert recording.frame(1).captured_unix_s == frame(1).device_time_s


@settings(max_examples=25, deadline=None)
@given(
    images=of_numpy.arrays(np.uint16, SHAPE, elements=st.integers(0, 65535)),
    number=st.integers(0, 2**63 - 1),
    times=st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 4),
    lost=st.integers(0, 2**31),
    epoch=st.integers(0, 2**32 - 1),
)
def test_any_frame_survives_the_way_through_a_file(
    images: np.ndarray[tuple[int, int, int], np.dtype[np.uint16]],
    number: int,
    times: tuple[float, float, float, float],
    lost: int,
    epoch: int,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    wanted = RawFrame(number, epoch, images, APPLIED.labels, *times, lost)
    path = tmp_path_factory.mktemp("any") / "a.h5"
    writer = RecordingWriter(path, header())
    writer.append(wanted)
    writer.close({})

    with Recording(path) as recording:
        assert_same(recording.frame(0), wanted)


@pytest.mark.parametrize("dtype", ["<u2", "<f4", "<f8", "|u1"])
def test_a_chunk_is_what_the_filters_of_hdf5_would_have_left(tmp_path: Path, dtype: str) -> None:
    block = np.random.default_rng(1).integers(0, 200, (3, 5, 7)).astype(dtype)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        written = swmr.create_blocks(file, "here", block.shape, dtype)
        written.resize(1, 0)
        written.id.write_direct_chunk((0, 0, 0, 0), swmr.compressed(block))
        theirs = swmr.create_blocks(file, "theirs", block.shape, dtype)
        theirs.resize(1, 0)
        theirs[0] = block

        np.testing.assert_array_equal(written[0], block)
        _, chunk = theirs.id.read_direct_chunk((0, 0, 0, 0))
        np.testing.assert_array_equal(swmr.expanded(chunk, block.shape, block.dtype), block)


def test_an_unfinished_recording_can_be_read_while_it_is_written(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    try:
        for number in range(3):
            writer.append(frame(number))
        with Recording(tmp_path / "a.h5.part") as recording:
            assert recording.frames == 3
            assert_same(recording.frame(2), frame(2))
            assert recording.end == {}
    finally:
        writer.close({})


def test_hdf5_is_never_called_past_the_lock_of_h5py(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # two threads inside HDF5 make it fail or crash
    set_read_attempts, locked = swmr._set_read_attempts, list[bool]()

    def call(*arguments: int) -> Any:
        locked.append(phil._is_owned())
        return set_read_attempts(*arguments)

    monkeypatch.setattr(swmr, "_set_read_attempts", call)

    swmr.open_unfinished(record(tmp_path / "a.h5", 1)).close()

    assert locked == [True]


def test_two_files_may_be_made_in_memory_at_a_time() -> None:
    inner: list[bytes] = []

    def make(file: swmr.File) -> None:
        inner.append(swmr.image_of(lambda other: other.attrs.update(which="inner")))
        file.attrs["which"] = "outer"

    outer = swmr.image_of(make)

    assert b"outer" in outer
    assert b"inner" in inner[0]
    assert b"inner" not in outer


def test_a_recording_may_begin_while_all_that_is_there_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_disk, read = disk.open_disk, list[Recording]()

    def listed_meanwhile(path: Path, mode: str) -> tuple[swmr.File, DiskFile]:
        # a file of this process, open to read, is not in the way of its writer
        read.extend(Recording(each) for each in Directory(tmp_path).files())
        return open_disk(path, mode)

    monkeypatch.setattr(disk, "open_disk", listed_meanwhile)
    record(tmp_path / "a.h5", 1)

    record(tmp_path / "b.h5", 2)

    assert [each.path.name for each in read] == ["a.h5"]
    read[0].close()
    with Recording(tmp_path / "b.h5") as recording:
        assert recording.frames == 2


def test_a_recording_ends_when_nobody_reads_what_there_is(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))
    reading = Recording(writer.part)
    ending = threading.Thread(target=writer.close, args=({"reason": "stopped"},))
    ending.start()

    assert_same(reading.frame(0), frame(0))
    assert writer.part.exists()
    reading.close()
    ending.join()

    with Recording(tmp_path / "a.h5") as recording:
        assert recording.end == {"reason": "stopped"}


def test_a_recording_never_replaces_one_that_is_written(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    with pytest.raises(FileExistsError, match=r"a\.h5\.part"):
        RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))
    writer.close({})
    with pytest.raises(FileExistsError, match=r"a\.h5"):
        RecordingWriter(tmp_path / "a.h5", header())

    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]
    with Recording(tmp_path / "a.h5") as recording:
        assert_same(recording.frame(0), frame(0))


def test_a_flipped_byte_in_a_chunk_is_found(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 3)
    with h5py.File(path) as file:
        place = file["raw"].id.get_chunk_info(1)
    _flip(path, place.byte_offset + place.size // 2)

    with Recording(path) as recording:
        assert_same(recording.frame(0), frame(0))
        with pytest.raises(DamagedFrame, match="frame 2 is damaged"):
            recording.frame(1)
        assert_same(recording.frame(2), frame(2))


def test_a_chunk_of_another_frame_is_found_by_the_checksum(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 3)
    with h5py.File(path, "r+") as file:  # a chunk that is whole, but not the right one
        file["raw"][1] = file["raw"][0]

    with Recording(path) as recording, pytest.raises(DamagedFrame, match="checksum"):
        recording.frame(1)


def test_a_recording_that_was_repacked_reads_the_same(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 3)
    with h5py.File(path) as source, h5py.File(tmp_path / "b.h5", "w") as target:
        target.attrs.update(source.attrs)
        for name, dataset in source.items():
            target.create_dataset(name, data=dataset[()], dtype=dataset.dtype)

    with Recording(tmp_path / "b.h5") as recording:
        for number in range(3):
            assert_same(recording.frame(number), frame(number))


@pytest.mark.parametrize("chunks", [(1, *SHAPE), (2, 3, 5, 7)])
@pytest.mark.parametrize("shuffle", [False, True])
def test_a_recording_that_was_compressed_otherwise_reads_the_same(
    tmp_path: Path, chunks: tuple[int, ...], shuffle: bool
) -> None:
    path = record(tmp_path / "a.h5", 3)
    with h5py.File(path, "r+") as file:
        values = file["raw"][()]
        del file["raw"]
        packed = {"compression": "gzip", "shuffle": shuffle, "chunks": chunks}
        file.create_dataset("raw", data=values, dtype="<u2", **packed)

    with Recording(path) as recording:
        for number in range(3):
            assert_same(recording.frame(number), frame(number))


def test_a_chunk_expands_to_its_stated_size_at_most(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 3)
    mebibyte = bytes(1024**2)
    bomb = isal_zlib.compress(256 * mebibyte, 1)
    with h5py.File(path, "r+") as file:
        file["raw"].id.write_direct_chunk((1, 0, 0, 0), bomb)

    with Recording(path) as recording:
        tracemalloc.start()
        with pytest.raises(DamagedFrame, match="expand"):
            recording.frame(1)
        _, peak_bytes = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert_same(recording.frame(2), frame(2))
    assert peak_bytes < 4 * len(mebibyte)


def other_place(file: Any, name: str) -> None:
    other = Path(file.filename).with_name("other.h5")
    shape, dtype = file[name].shape, file[name].dtype
    del file[name]
    file.create_dataset(name, shape, dtype, external=[(str(other), 0, h5py.h5f.UNLIMITED)])


def virtual(file: Any, name: str) -> None:
    other = Path(file.filename).with_name("other.h5")
    shape, dtype = file[name].shape, file[name].dtype
    del file[name]
    layout = h5py.VirtualLayout(shape, dtype)
    layout[...] = h5py.VirtualSource(str(other), name, shape)
    file.create_virtual_dataset(name, layout)


def replaced(file: Any, name: str, value: Any) -> None:
    del file[name]
    file[name] = value


def end(file: Any, document: str) -> None:
    file["end"][()] = document.encode()


def capability(file: Any, **changes: Any) -> None:
    file.attrs["capabilities"] = json.dumps(json.loads(file.attrs["capabilities"]) | changes)


def longer(file: Any, rows: int) -> None:
    for name in (*recording_layout.SERIES, "frame", "raw"):
        file[name].resize(rows, 0)


def stored_in(file: Any, name: str, *, chunks: tuple[int, ...]) -> None:
    """State a million values, of which none is written, in so large chunks."""
    dtype = file[name].dtype
    del file[name]
    file.create_dataset(name, (10**6,), dtype, chunks=chunks)


CRAFTED: dict[str, tuple[Callable[[Any], object], str]] = {
    "no annotations": (lambda file: file.__delitem__("annotations"), "it has no annotations"),
    "annotations in a group": (
        lambda file: (file.__delitem__("annotations"), file.create_group("annotations")),
        "annotations is no dataset",
    ),
    "annotations by a link": (
        lambda file: replaced(file, "annotations", h5py.ExternalLink("other.h5", "/annotations")),
        "annotations is a link to elsewhere",
    ),
    "annotations by a soft link": (
        lambda file: replaced(file, "annotations", h5py.SoftLink("/end")),
        "annotations is a link to elsewhere",
    ),
    "images in a group": (
        lambda file: (file.__delitem__("raw"), file.create_group("raw")),
        "raw is no dataset",
    ),
    "images of three axes": (
        lambda file: replaced(file, "raw", np.zeros((3, HEIGHT, WIDTH), "<u2")),
        "raw has 3 axes, not 4",
    ),
    "images of floating point": (
        lambda file: replaced(file, "raw", np.zeros((3, *SHAPE), "<f4")),
        "raw holds float32, not uint16",
    ),
    "images in another file": (lambda file: other_place(file, "raw"), "stored in other files"),
    "a virtual series": (lambda file: virtual(file, "frame"), "stored in other files"),
    "images packed otherwise": (
        lambda file: (
            file.__delitem__("raw"),
            file.create_dataset("raw", data=np.zeros((3, *SHAPE), "<u2"), compression="lzf"),
        ),
        "raw is packed with filters",
    ),
    "a series of 10^12 values": (lambda file: longer(file, 10**12), "states a size of"),
    "a series in 62500 chunks that were never written": (
        lambda file: stored_in(file, "host_time_s", chunks=(16,)),
        "in 62500 chunks",
    ),
    "a time that is no number": (
        lambda file: file["host_time_s"].__setitem__(1, np.nan),
        "host_time_s is nan",
    ),
    "a duration in words": (lambda file: end(file, '{"duration_s":"abc"}'), "end.duration_s"),
    "a duration beyond all floats": (
        lambda file: end(file, '{"duration_s":1' + 400 * "0" + "}"),
        "end.duration_s",
    ),
    "a duration before the start": (lambda file: end(file, '{"duration_s":-1}'), "end.duration_s"),
    "a reason in a list": (lambda file: end(file, '{"reason":[1]}'), "end.reason"),
    "versions in a list": (
        lambda file: file.attrs.__setitem__("versions", "[1]"),
        "for a JSON object",
    ),
    "capabilities in a list": (
        lambda file: file.attrs.__setitem__("capabilities", "[1]"),
        "for a JSON object",
    ),
    "a width in words": (lambda file: capability(file, width="wide"), "capabilities have width"),
    "a sensor of a terabyte": (
        lambda file: capability(file, width=10**6, height=10**6),
        "its images have shape",
    ),
    "a document of a thousand levels": (
        lambda file: file.attrs.__setitem__("camera", '{"a":' * 900 + "1" + "}" * 900),
        "levels|recursion",
    ),
    "half a character": (
        lambda file: file.attrs.__setitem__("camera", '{"a":"\\ud800"}'),
        "surrogates not allowed",
    ),
    "a title that is an array": (
        lambda file: file.attrs.__setitem__("title", ["a", "b"]),
        "title is an array",
    ),
    "labels of another sequence": (
        lambda file: file["take"].__setitem__(0, 5),
        "labelled otherwise",
    ),
}


@pytest.mark.parametrize("name", CRAFTED)
def test_a_crafted_recording_is_refused_with_the_reason(tmp_path: Path, name: str) -> None:
    change, reason = CRAFTED[name]
    path = record(tmp_path / "a.h5", 3)
    record(tmp_path / "other.h5", 3)
    with h5py.File(path, "r+") as file:
        change(file)

    with pytest.raises(NotARecording, match=reason):
        Recording(path)


def test_a_damaged_unfinished_recording_is_given_up_soon(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))
    part = tmp_path / "b.h5.part"
    part.write_bytes(writer.part.read_bytes())
    writer.close({})
    with h5py.File(tmp_path / "a.h5") as file:
        place = h5py.h5o.get_info(file["crc32"].id).addr
    _flip(part, place + 20)

    # HDF5 by itself would read the block a hundred times, and wait twice as long each time
    with pytest.raises(NotARecording, match="checksum"):
        Recording(part)


def test_any_hdf5_reader_finds_images_labels_and_documents(tmp_path: Path) -> None:
    with h5py.File(record(tmp_path / "a.h5", 4)) as file:
        np.testing.assert_array_equal(file["raw"][2], frame(2).images)
        assert file["raw"].dims[0][0].name == "/frame"
        assert json.loads(file.attrs["sequence"])["harmonics"] == 2
        np.testing.assert_array_equal(
            file["phase_rad"][()], [label.phase_rad for label in APPLIED.labels]
        )
        expected = [isal_zlib.crc32(file["raw"][row].astype("<u2").tobytes()) for row in range(4)]
        assert file["crc32"][()].tolist() == expected


def test_a_frame_that_is_not_there_is_an_index_error(tmp_path: Path) -> None:
    with Recording(record(tmp_path / "a.h5", 2)) as recording:
        for index in (-1, 2):
            with pytest.raises(IndexError, match=f"frame {index} of 2"):
                recording.frame(index)


def test_what_is_no_recording_is_refused_with_the_reason(tmp_path: Path) -> None:
    text, foreign, newer = (tmp_path / name for name in ("a.txt", "b.h5", "c.h5"))
    text.write_text("hello")
    with h5py.File(foreign, "w") as file:
        file["x"] = 1
    record(newer, 1)
    with h5py.File(newer, "r+") as file:
        file.attrs["format_version"] = 2

    reasons = {text: "file signature", foreign: "no attribute format", newer: "version 2"}
    for path, reason in reasons.items():
        with pytest.raises(NotARecording, match=reason):
            Recording(path)
    with pytest.raises(FileNotFoundError):
        Recording(tmp_path / "absent.h5")


def test_a_writer_never_replaces_a_recording(tmp_path: Path) -> None:
    record(tmp_path / "a.h5", 1)

    with pytest.raises(FileExistsError):
        RecordingWriter(tmp_path / "a.h5", header())
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_a_finished_recording_opens_in_xarray_with_named_axes(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(record(tmp_path / "a.h5", 3), engine="h5netcdf") as dataset:
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        assert dataset["frequency_hz"].dims == ("image",)
        np.testing.assert_array_equal(dataset["raw"][1], frame(1).images)


def _flip(path: Path, offset: int) -> None:
    with path.open("r+b") as file:
        file.seek(offset)
        byte = file.read(1)[0]
        file.seek(offset)
        file.write(bytes([byte ^ 0x10]))
