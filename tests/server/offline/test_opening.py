"""`transientcam.open`: recordings as sequences of frames, of a file or of a daemon."""

import json
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam
import transientcam_moments as tm
from tests.server.recording.made import APPLIED, HEIGHT, WIDTH, frame, header, record
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import ParameterError, ProblemError, opening
from transientcam_server.errors import DamagedFrame, InputError, NotARecording
from transientcam_server.imaging import nominal_gains
from transientcam_server.recording import RecordingWriter

FRAMES = 4
OF_NEW_FILES = ("gain", "weight", "modulus", "kind", "moment", "sub_phase_rad", "sub_phase_share")


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The entry point as it is in pyproject.toml, whichever version is installed."""
    point = EntryPoint("hdf5", "transientcam_server.offline._opening:open_recording", opening.GROUP)
    monkeypatch.setattr(opening, "entry_points", lambda group: [point])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return record(tmp_path / "a.h5", FRAMES, reconstruction={"bias": 0.01, "smoothing_px": 0.0})


def test_a_file_is_a_sequence_of_frames(path: Path) -> None:
    with transientcam.open(path) as recording:
        assert len(recording) == len(recording.frames) == FRAMES
        np.testing.assert_array_equal(recording[1].raw, frame(1).images)
        np.testing.assert_array_equal(recording.frames[-1].raw, frame(3).images)
        assert [each.index for each in recording[1:]] == [1, 2, 3]
        assert [each.index for each in recording[::-2]] == [3, 1]
        assert [each.index for each in recording] == [0, 1, 2, 3]
        with pytest.raises(IndexError):
            _ = recording[FRAMES]
        assert recording.sequence["harmonics"] == 2
        assert recording.settings["bias"] == 0.01
        assert recording.settings["neighbours"] == "gaussian"  # all there was before the setting
        assert recording.labels["kind"].tolist() == ["modulated"] * 8
        np.testing.assert_allclose(recording.gains, nominal_gains(APPLIED.sequence))
        assert "4 frames of 16 x 12 pixels, m = 2 at 23 MHz" in repr(recording)
        page: str = recording._repr_html_()  # type: ignore[attr-defined]  # for notebooks
        assert "<th>zeroth</th><td>estimated</td>" in page


def test_raw_images_are_read_as_they_are_indexed(path: Path) -> None:
    everything = np.stack([frame(number).images for number in range(FRAMES)])
    with transientcam.open(path) as recording:
        raw = recording.raw
        assert (raw.shape, raw.dtype, raw.ndim, len(raw)) == ((4, 8, HEIGHT, WIDTH), "<u2", 4, 4)
        for index in (2, slice(1, 3), (slice(None), 0), (..., 5), (-1, slice(0, 2), 3, 4)):
            np.testing.assert_array_equal(raw[index], everything[index])
        assert raw[4:].shape == (0, 8, HEIGHT, WIDTH)
        np.testing.assert_array_equal(np.asarray(raw), everything)


def test_products_are_those_of_the_arithmetic_with_the_recorded_settings(path: Path) -> None:
    sequence = APPLIED.sequence
    settings = tm.Settings(
        sequence.base_frequency_hz,
        "estimated",
        1,
        epsilon=0.01,
        smoothing_sigma_px=0.0,
        sensor=tm.noise.Sensor(),
    )
    expected = tm.reconstruct(frame(2).images, settings, calibration=nominal_gains(sequence))
    with transientcam.open(path) as recording:
        found = recording.frames[2]
        np.testing.assert_allclose(found.range_m, expected.range_m, rtol=1e-5)
        np.testing.assert_array_equal(found.range, found.range_m)
        np.testing.assert_array_equal(found.flags, expected.flags)
        np.testing.assert_allclose(found.direct, expected.direct, rtol=1e-4)
        assert found.moments.shape == (3, HEIGHT, WIDTH)
        video = found.product("transient", time_s=[5e-9, 9e-9], region=(2, 3, 4, 5))
        np.testing.assert_allclose(
            video, expected.density(np.array([5e-9, 9e-9]))[:, 3:8, 2:6], rtol=1e-3
        )
        assert (video.unit, video.meta["frame"]) == ("DN/s", 3)
        assert found.product("cumulative", bins=7).array.shape == (7, HEIGHT, WIDTH)
        assert "range" in dir(found)
        with pytest.raises(AttributeError, match="no 'truth'; products: range"):
            _ = found.truth
        with pytest.raises(ParameterError, match="density_std"):
            found.product("density_std")
        with pytest.raises(ParameterError, match="left out"):
            found.product("range", bins=4)


def test_every_product_a_recording_has_is_computed(path: Path) -> None:
    with transientcam.open(path) as recording:
        for name in ("returns", "coefficients", "streak", "bounds", "pointcloud", "validity"):
            assert getattr(recording[0], name).size


def test_settings_can_be_others_than_the_recorded_ones(path: Path) -> None:
    with transientcam.open(path, settings={"estimator": "single-frequency"}) as recording:
        phase_rad = np.angle(tm.measure(frame(0).images, zeroth="estimated")[1]) % (2 * np.pi)
        assert recording.settings["estimator"] == "single-frequency"
        plain = {**recording.settings, "smoothing_px": 0.0}
    with transientcam.open(path, settings=plain) as recording:
        turned = np.exp(1j * (phase_rad - np.angle(nominal_gains(APPLIED.sequence)[1])))
        found = np.exp(4j * np.pi * 23e6 / tm.SPEED_OF_LIGHT_M_S * recording[0].range_m)
        np.testing.assert_allclose(found, turned, atol=1e-4)


def test_settings_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    source = record(tmp_path / "later.h5", 1, reconstruction={"new": 1})

    with pytest.raises(InputError, match=r"later\.h5: reconstruction\.new is 1"):
        transientcam.open(source)
    with transientcam.open(source, settings={}) as recording:
        assert len(recording) == 1


def test_a_recording_of_before_its_gains_were_written_opens(path: Path) -> None:
    with transientcam.open(path) as recording:
        expected, gains = recording[0].range_m, recording.gains
    with h5py.File(path, "r+") as file:
        for name in OF_NEW_FILES:
            del file[name]

    with transientcam.open(path) as recording:
        np.testing.assert_array_equal(recording[0].range_m, expected)
        np.testing.assert_array_equal(recording.gains, gains)
        assert recording.to_xarray()["weight"].shape == (3, 8)


def test_measured_gains_are_those_of_the_file(tmp_path: Path) -> None:
    planes = np.full((3, HEIGHT, WIDTH), 0.5 - 1j, np.complex64)
    source = record(tmp_path / "a.h5", 1, calibration_planes=planes)
    with transientcam.open(source) as recording:
        np.testing.assert_array_equal(recording.gains, planes)


def test_a_recording_that_is_still_written_shows_what_there_is(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.h5", header())
    writer.append(frame(0))
    with transientcam.open(tmp_path / "a.h5.part") as recording:
        assert len(recording) == 1
        np.testing.assert_array_equal(recording[0].raw, frame(0).images)
    writer.close({})


def test_a_closed_recording_says_so_and_what_was_read_stays(path: Path) -> None:
    with transientcam.open(path) as recording:
        read, unread = recording[0], recording[1]
        _ = read.raw
    assert read.range_m.shape == (HEIGHT, WIDTH)
    with pytest.raises(ValueError, match=r"a\.h5 is closed"):
        _ = unread.raw


def test_a_damaged_frame_is_no_array_of_numbers(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["crc32"][1] ^= 1
    with transientcam.open(path) as recording:
        assert recording[0].raw.any()
        for read in (lambda: recording[1].range_m, lambda: recording.raw[:]):
            with pytest.raises(DamagedFrame):
                read()


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\n", b"no recording"])
def test_a_file_that_is_none_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(NotARecording, match=r"a\.h5"):
        transientcam.open(tmp_path / "a.h5")
    with pytest.raises(FileNotFoundError):
        transientcam.open(tmp_path / "absent.h5")


def test_xarray_has_images_labels_and_products_and_reads_what_is_indexed(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["crc32"][3] ^= 1  # nothing below reads the last frame
    with transientcam.open(path) as recording:
        dataset = recording.to_xarray("range", "transient")
        assert dataset["raw"].dims == ("frame", "image", "y", "x")
        assert dataset["range"].attrs["units"] == "m"
        np.testing.assert_array_equal(dataset["raw"][1, 2], frame(1).images[2])
        np.testing.assert_array_equal(dataset["range"][2], recording[2].range_m)
        np.testing.assert_array_equal(
            dataset["transient"].isel(frame=slice(0, 2), y=3),
            [each.transient[:, 3] for each in recording[:2]],
        )
        assert dataset["gain"].dims == ("moment",)
        assert json.loads(dataset.attrs["sequence"])["harmonics"] == 2
        with pytest.raises(ParameterError, match="colour"):
            recording.to_xarray("colour")


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    kept = {"directory": tmp_path_factory.mktemp("kept"), "min_free_bytes": 0}
    with serving("sim:mirrors", recordings=kept) as daemon:
        daemon.start_all_workers()
        yield daemon


def product(camera: transientcam.Camera, name: str, **which: Any) -> NDArray[Any]:
    return np.asarray(camera.frame(name, **which).array)


def test_a_daemons_recording_opens_by_its_address_with_the_daemons_numbers(served: Served) -> None:
    names = ("range", "direct", "indirect", "brightness", "validity", "moments", "flags")
    with transientcam.Camera(served.url, timeout_s=60.0) as camera:
        running = camera.record()["id"]
        with pytest.raises(ProblemError, match="not finished"):
            transientcam.open(f"{served.url}/api/v1/recordings/{running}")
        wait_until(lambda: camera.recording(running)["frames"] >= 3)
        frames = camera.stop_recording(running)["frames"]
        with transientcam.open(f"{served.url}/api/v1/recordings/{running}") as recording:
            assert len(recording) == frames
            for name in names:
                expected = product(camera, name, recording=running, number=2)
                found = getattr(recording[1], name)
                assert found.dtype == expected.dtype
                # kernels that are compiled meanwhile may round otherwise
                close = np.isclose(found, expected, rtol=1e-4, atol=1e-3, equal_nan=True)
                assert close.mean() > 0.998, name
            live = camera.frame("range", recording=running, number=2)
            assert recording[1].meta["host_time_s"] == live.meta["host_time_s"]
            assert recording[1].meta["calibration_id"] == live.meta["calibration_id"]
        with pytest.raises(ProblemError, match="no recording"):
            transientcam.open(f"{served.url}/api/v1/recordings/20200101T000000Z-000000")
