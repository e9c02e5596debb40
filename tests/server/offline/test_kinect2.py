"""Raw frames of a Kinect v2 in the layout of kinectv2_decoders become a recording."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import typer
from numpy.typing import NDArray
from typer.testing import CliRunner

import transientcam_moments as tm
from transientcam_driver.cameras.kinect2 import SUB_IMAGE_BYTES, P0Tables, codes, encoder
from transientcam_server.cli.import_kinect2 import import_kinect2 as verb
from transientcam_server.errors import InputError
from transientcam_server.offline import import_kinect2, read_lens
from transientcam_server.offline._opening import open_recording

FREQUENCIES_HZ = np.array([16e6, 80e6, 120e6])[:, None, None]
Array = NDArray[Any]


@pytest.fixture(scope="module")
def tables() -> P0Tables:
    units = np.random.default_rng(1).integers(0, 65_536, (3, 424, 512))
    return P0Tables(units.astype(np.uint16))


@pytest.fixture(scope="module")
def range_m() -> Array:
    return np.linspace(1.0, 8.0, 424)[:, None] + np.linspace(0.0, 0.5, 512)


@pytest.fixture(scope="module")
def sub_images(tables: P0Tables, range_m: Array) -> Array:
    b = 500 * np.exp(2j * np.pi * FREQUENCIES_HZ * 2 * range_m / tm.SPEED_OF_LIGHT_M_S)
    return codes.sub_images(encoder.samples(b, tables.gains()))


@pytest.fixture
def source(tmp_path: Path, tables: P0Tables, sub_images: Array) -> Path:
    """A file with frames 0, 2 and 10, the last one without a tenth sub-image."""
    path = tmp_path / "wall.h5"
    with h5py.File(path, "w") as file:
        file["P0Tables"] = np.frombuffer(tables.pack(), np.int8)
        tenth = np.zeros(SUB_IMAGE_BYTES, np.uint8)
        whole = np.concatenate([sub_images.ravel(), tenth]).view(np.int8)
        file["Frame_0/Ir"] = whole
        file["Frame_2/Ir"] = np.roll(whole, 3 * SUB_IMAGE_BYTES)
        file["Frame_10/Ir"] = sub_images.ravel().view(np.int8)
        file["Frame_10/Color"] = np.zeros(10, np.int8)
    return path


def write_lens(path: Path, distortion: list[float]) -> Path:
    """Write a calibration as that project has it, with vectors of any length."""
    vector = h5py.vlen_dtype(np.float64)
    names = ("distortion_coefficients", "num_distortion_coefficients", "intrinsic_camera_matrix")
    layout = np.dtype(list(zip(names, (vector, np.int32, vector), strict=True)))
    stored = np.empty(1, layout)
    matrix = np.array([365.5, 0, 255.5, 0, 366.5, 205.0, 0, 0, 1.0])
    stored[0] = (np.array(distortion), len(distortion), matrix)
    with h5py.File(path, "w") as file:
        file["leader_calibration_parameters"] = stored
    return path


def test_frames_become_a_recording_with_the_gains_of_the_tables(
    tmp_path: Path, source: Path, tables: P0Tables, range_m: Array
) -> None:
    seen: list[tuple[int, int]] = []

    def progress(done: int, total: int) -> None:
        seen.append((done, total))

    frames = import_kinect2(source, tmp_path / "out.h5", progress=progress)

    assert frames == 3
    assert seen == [(1, 3), (2, 3), (3, 3)]
    settings = {"estimator": "unwrapped-phase", "smoothing_px": 0.0}
    with open_recording(str(tmp_path / "out.h5"), settings=settings) as recording:
        assert recording.sequence["sampling"]["multiples"] == [2, 10, 15]
        assert (recording.gains == tables.gains()).all()
        assert recording.series("device_frame").tolist() == [0, 2, 10]
        assert recording.series("device_time_s") == pytest.approx([0, 2 / 30, 10 / 30])
        found_m = recording[2].range_m
        assert (recording.raw[0] == recording.raw[2]).all()
    # codes of 512 counts and more are 4 apart
    assert np.abs(found_m - range_m)[:, 1:-1].max() < 2e-3


def test_a_lens_is_recorded_with_them(tmp_path: Path, source: Path) -> None:
    calibration = write_lens(tmp_path / "lens.h5", [0.09, -0.27, 0.0, 0.0, 0.095])
    lens = read_lens(calibration, "bottom")

    import_kinect2(source, tmp_path / "out.h5", lens=lens)

    with open_recording(str(tmp_path / "out.h5")) as recording:
        found = recording.recipe.intrinsics
    assert found is not None
    assert (found.fx, found.fy, found.cx) == (365.5, 366.5, 255.0)
    assert found.cy == 424 - 205.0 - 0.5
    assert found.distortion == (0.09, -0.27, 0.0, 0.0, 0.095)
    assert found.source == "recording"


def replaced(name: str, values: Array | None) -> Callable[[Any], None]:
    def change(file: Any) -> None:
        del file[name]
        if values is not None:
            file[name] = values

    return change


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (replaced("P0Tables", None), "P0Tables is absent"),
        (replaced("P0Tables", np.zeros(100, np.int8)), r"P0Tables is int8 of shape \(100,\)"),
        (replaced("Frame_2/Ir", None), "Frame_2/Ir is absent"),
        (replaced("Frame_2/Ir", np.zeros((3, 3))), "Frame_2/Ir is float64"),
        (
            replaced("Frame_10/Ir", np.zeros(9 * SUB_IMAGE_BYTES + 1, np.int8)),
            "Frame_10/Ir is 2686465 bytes",
        ),
    ],
)
def test_another_layout_is_refused_by_name_and_leaves_nothing(
    tmp_path: Path, source: Path, change: Callable[[Any], None], says: str
) -> None:
    with h5py.File(source, "a") as file:
        change(file)

    with pytest.raises(InputError, match=says):
        import_kinect2(source, tmp_path / "out.h5")

    assert not list(tmp_path.glob("out*"))


def test_what_is_no_file_of_frames_is_refused(tmp_path: Path, tables: P0Tables) -> None:
    text, empty = tmp_path / "text.h5", tmp_path / "empty.h5"
    text.write_text("frames")
    with h5py.File(empty, "w") as file:
        file["P0Tables"] = np.frombuffer(tables.pack(), np.uint8)

    with pytest.raises(InputError, match="HDF5"):
        import_kinect2(text, tmp_path / "out.h5")
    with pytest.raises(InputError, match="Frame_0/Ir is absent"):
        import_kinect2(empty, tmp_path / "out.h5")
    with pytest.raises(FileNotFoundError):
        import_kinect2(tmp_path / "none.h5", tmp_path / "out.h5")
    with pytest.raises(InputError, match="leader_calibration_parameters is absent"):
        read_lens(empty)
    for distortion in ([0.1], [np.nan] * 5):
        with pytest.raises(InputError, match="five coefficients"):
            read_lens(write_lens(tmp_path / "lens.h5", distortion))


def test_the_verb_says_how_many_frames_there_are(tmp_path: Path, source: Path) -> None:
    app = typer.Typer()
    app.command()(verb)
    output = tmp_path / "out.h5"

    found = CliRunner().invoke(app, [str(source), "-o", str(output), "--json"])

    assert found.exit_code == 0
    assert '"frames": 3' in found.stdout
    assert output.exists()
    assert CliRunner().invoke(app, [str(source), "-o", str(tmp_path / "out.npz")]).exit_code == 2
