import json
import sys
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
import zarr
from mcap.reader import make_reader
from zarr.core.sync import cleanup_resources

from tests.server.recording.made import APPLIED, frame, record
from transientcam_server.errors.exceptions import DamagedFrame, MissingExtra, NotConvertible
from transientcam_server.offline import convert_recording
from transientcam_server.recording import Recording

FRAMES = 3


@pytest.fixture(autouse=True)
def threads_of_zarr() -> Iterator[None]:
    """End the threads that zarr otherwise keeps for the life of the process."""
    yield
    cleanup_resources()


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return record(tmp_path / "a.h5", FRAMES, annotations={"a": 1})


def test_npz_has_images_labels_and_documents(source: Path, tmp_path: Path) -> None:
    done: list[tuple[int, int]] = []
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.npz", progress=lambda *each: done.append(each))

    with np.load(tmp_path / "a.npz") as archive:
        for number in range(FRAMES):
            np.testing.assert_array_equal(archive["raw"][number], frame(number).images)
        assert archive["frame"].tolist() == [0, 1, 2]
        assert archive["harmonic"].tolist() == [label.harmonic for label in APPLIED.labels]
        assert json.loads(str(archive["annotations"])) == {"a": 1}
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_netcdf_opens_in_xarray(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.nc")

    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as dataset:
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        assert dataset["device_time_s"].dims == ("frame",)
        np.testing.assert_array_equal(dataset["raw"][2], frame(2).images)
        assert json.loads(dataset.attrs["sequence"])["harmonics"] == 2


def test_zarr_opens_in_zarr_and_xarray(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.zarr")

    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    raw = group["raw"]
    assert isinstance(raw, zarr.Array)
    np.testing.assert_array_equal(raw[1], frame(1).images)
    with xarray.open_zarr(tmp_path / "a.zarr", consolidated=False) as dataset:
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        np.testing.assert_array_equal(dataset["frame"], np.arange(FRAMES))


def test_mcap_has_an_image_a_topic_with_its_label_and_time(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.mcap")
        host_time_s = recording.series("host_time_s")

    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream)
        (metadata,) = reader.iter_metadata()
        found = [
            (schema.name, channel, message)
            for schema, channel, message in reader.iter_messages(topics=["/raw/001"])
            if schema is not None
        ]
    assert json.loads(metadata.metadata["sequence"])["harmonics"] == 2
    assert len(found) == FRAMES
    for number, (schema, channel, message) in enumerate(found):
        assert schema == "foxglove.RawImage"
        assert json.loads(channel.metadata["harmonic"]) == APPLIED.labels[1].harmonic
        assert message.log_time == pytest.approx(host_time_s[number] * 1e9, abs=1e3)
        assert frame(number).images[1].astype("<u2").tobytes() in message.data


def test_another_suffix_is_refused_with_those_there_are(source: Path, tmp_path: Path) -> None:
    with (
        Recording(source) as recording,
        pytest.raises(NotConvertible, match=r"a\.mat: .* \.mcap, \.nc, \.npz, \.zarr"),
    ):
        convert_recording(recording, tmp_path / "a.mat")


def test_a_missing_library_is_named_with_its_extra(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "zarr", None)
    with (
        Recording(source) as recording,
        pytest.raises(MissingExtra, match=r"transientcam\[convert\]"),
    ):
        convert_recording(recording, tmp_path / "a.zarr")


def test_nothing_is_left_of_a_conversion_that_failed(source: Path, tmp_path: Path) -> None:
    with h5py.File(source, "r+") as file:
        file["crc32"][1] ^= 1
    for suffix in ("npz", "nc", "zarr"):
        with Recording(source) as recording, pytest.raises(DamagedFrame):
            convert_recording(recording, tmp_path / f"b.{suffix}")

    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]


def test_what_is_there_is_not_replaced(source: Path, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_text("mine")
    with Recording(source) as recording, pytest.raises(FileExistsError):
        convert_recording(recording, tmp_path / "a.npz")
