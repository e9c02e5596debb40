import io
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
import zarr
from mcap.reader import make_reader
from numpy.typing import NDArray
from zarr.core.sync import cleanup_resources

import transientcam_moments as tm
from tests.server.recording.failing import FailingDisk, Fault
from tests.server.recording.made import APPLIED, HEIGHT, WIDTH, frame, record
from transientcam_server.errors import DamagedFrame, MissingExtra, NotConvertible
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


def assert_images_make_moments(columns: Any, images: NDArray[np.uint16]) -> None:
    """Weights, modulus and gains of a file make of images what the arithmetic makes of them."""
    weight, modulus, gain = (np.asarray(columns[name]) for name in ("weight", "modulus", "gain"))
    total = np.tensordot(weight, images.astype(float), 1)
    found = np.where(modulus.reshape(-1, 1, 1) > 0, abs(total), total)
    found = found / gain.reshape(len(gain), *(gain.shape[1:] or (1, 1)))

    measured = tm.measure(images.astype(float), zeroth="estimated")
    steps = APPLIED.sequence.sub_phases
    of = tm.modulation_gain(1, steps.phases_rad, steps.weights)
    np.testing.assert_allclose(found[1:], measured[1:] / of, rtol=1e-12)
    assert (found[0] == 0).all()


@pytest.mark.parametrize("suffix", ["npz", "nc", "zarr", "mcap"])
def test_measured_gains_and_bad_pixels_go_with_the_images(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(0)
    planes = rng.normal(size=(3, HEIGHT, WIDTH)).astype(np.complex64) * (1 + 2j)
    bad = rng.random((HEIGHT, WIDTH)) < 0.1
    source = record(tmp_path / "a.h5", 1, calibration_planes=planes, calibration_bad=bad)
    output = tmp_path / f"a.{suffix}"
    with Recording(source) as recording:
        convert_recording(recording, output)

    found = {"nc": in_xarray, "zarr": in_xarray, "npz": in_npz, "mcap": in_mcap}[suffix](output)
    np.testing.assert_array_equal(found["gain"], planes)
    np.testing.assert_array_equal(found["bad"] > 0, bad)


def in_xarray(path: Path) -> dict[str, NDArray[Any]]:
    engine = "zarr" if path.suffix == ".zarr" else "h5netcdf"
    with xarray.open_dataset(path, engine=engine) as dataset:
        return {name: dataset[name].to_numpy() for name in ("gain", "bad")}


def in_npz(path: Path) -> dict[str, NDArray[Any]]:
    with np.load(path) as archive:
        return {name: archive[name] for name in ("gain", "bad")}


def in_mcap(path: Path) -> dict[str, NDArray[Any]]:
    with path.open("rb") as stream:
        (attachment,) = make_reader(stream).iter_attachments()
    with np.load(io.BytesIO(attachment.data)) as archive:
        return {name: archive[name] for name in ("gain", "bad")}


def test_npz_has_images_labels_and_documents(source: Path, tmp_path: Path) -> None:
    done: list[tuple[int, int]] = []
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.npz", progress=lambda *each: done.append(each))

    with np.load(tmp_path / "a.npz") as archive:
        for number in range(FRAMES):
            np.testing.assert_array_equal(archive["raw"][number], frame(number).images)
        assert archive["frame"].tolist() == [1, 2, 3]
        assert archive["harmonic"].tolist() == [label.harmonic for label in APPLIED.labels]
        assert json.loads(str(archive["annotations"])) == {"a": 1}
        assert archive["kind"].tolist() == ["modulated"] * len(APPLIED.labels)
        assert archive["sub_phase_rad"].shape == archive["sub_phase_share"].shape == (8,)
        assert_images_make_moments(archive, frame(1).images)
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_netcdf_opens_in_xarray(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.nc")

    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as dataset:
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        assert dataset["device_time_s"].dims == ("frame",)
        np.testing.assert_array_equal(dataset["raw"][2], frame(2).images)
        assert dataset["kind"].attrs["flag_meanings"] == "off on modulated"
        assert dataset["weight"].dims == ("moment", "image")
        assert_images_make_moments(dataset, frame(1).images)
        assert json.loads(dataset.attrs["sequence"])["harmonics"] == 2


def test_zarr_opens_in_zarr_and_xarray(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.zarr")

    group = zarr.open_group(tmp_path / "a.zarr", mode="r")
    raw = group["raw"]
    assert isinstance(raw, zarr.Array)
    np.testing.assert_array_equal(raw[1], frame(1).images)
    with xarray.open_zarr(tmp_path / "a.zarr", consolidated=True, chunks=None) as dataset:
        assert_images_make_moments(dataset, frame(1).images)
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        np.testing.assert_array_equal(dataset["frame"], np.arange(1, FRAMES + 1))


def test_mcap_has_an_image_a_topic_with_its_label_and_time(source: Path, tmp_path: Path) -> None:
    with Recording(source) as recording:
        convert_recording(recording, tmp_path / "a.mcap")
        captured_s = recording.captured_unix_s

    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream)
        (metadata,) = reader.iter_metadata()
        (attachment,) = reader.iter_attachments()
        found = [
            (schema.name, channel, message)
            for schema, channel, message in reader.iter_messages(topics=["/raw/image_001"])
            if schema is not None
        ]
    assert json.loads(metadata.metadata["sequence"])["harmonics"] == 2
    assert len(found) == FRAMES
    assert attachment.name == "columns.npz"
    with np.load(io.BytesIO(attachment.data)) as columns:
        assert_images_make_moments(columns, frame(1).images)
    for number, (schema, channel, message) in enumerate(found):
        assert schema == "foxglove.RawImage"
        assert json.loads(channel.metadata["harmonic"]) == APPLIED.labels[1].harmonic
        assert json.loads(channel.metadata["kind"]) == "modulated"
        assert json.loads(channel.metadata["weight"]) == [[0, 0], [0, 1], [0, 0]]
        assert message.log_time == pytest.approx(captured_s[number] * 1e9, abs=1e3)
        assert frame(number).images[1].astype("<u2").tobytes() in message.data


def test_another_suffix_is_refused_with_those_there_are(source: Path, tmp_path: Path) -> None:
    with (
        Recording(source) as recording,
        pytest.raises(NotConvertible, match=r"a\.mat: .* \.mcap, \.nc, \.npz, \.zarr"),
    ):
        convert_recording(recording, tmp_path / "a.mat")


@pytest.mark.parametrize(
    ("module", "suffix", "options"),
    [("zarr", "zarr", {}), ("foxglove", "mcap", {}), ("rosbags", "mcap", {"schemas": "ros2"})],
)
def test_a_missing_library_is_named_with_its_extra(
    source: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    module: str,
    suffix: str,
    options: dict[str, Any],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with (
        Recording(source) as recording,
        pytest.raises(MissingExtra, match=rf"needs {module}: .*transientcam\[convert\]"),
    ):
        convert_recording(recording, tmp_path / f"a.{suffix}", **options)


def test_nothing_is_left_of_a_conversion_that_failed(source: Path, tmp_path: Path) -> None:
    with h5py.File(source, "r+") as file:
        file["crc32"][1] ^= 1
    for suffix in ("npz", "nc", "zarr", "mcap"):
        with Recording(source) as recording, pytest.raises(DamagedFrame):
            convert_recording(recording, tmp_path / f"b.{suffix}")

    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]


def test_what_is_there_is_not_replaced(source: Path, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_text("mine")
    with Recording(source) as recording, pytest.raises(FileExistsError):
        convert_recording(recording, tmp_path / "a.npz")


@pytest.mark.parametrize("at", [1, 4, 20])
def test_a_disk_that_is_full_leaves_nothing_of_a_netcdf(
    source: Path, tmp_path: Path, at: int
) -> None:
    with (
        Recording(source) as recording,
        FailingDisk(Fault(at, "ENOSPC", for_ever=True)).inserted(),
        pytest.raises(OSError, match="No space left on device"),
    ):
        convert_recording(recording, tmp_path / "a.nc")

    assert [path.name for path in tmp_path.iterdir()] == [source.name]
