import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

import transientcam
import transientcam_moments as tm
from tests.conftest import ROOT
from tests.programs import needs_octave
from tests.server.recording.failing import FailingDisk, Fault
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.errors import InputError
from transientcam_server.imaging import PRODUCTS, Recipe
from transientcam_server.imaging._products.view import EVERYTHING
from transientcam_server.offline import BatchOptions, convert_recording, reconstruct_recording
from transientcam_server.offline._recording import DEFAULT_PRODUCTS
from transientcam_server.recording import Header, Recording, RecordingWriter, ZarrKeys
from transientcam_server.settings import ReconstructionSettings

FRAMES = 4
QUICK = BatchOptions(settings=ReconstructionSettings(estimator="pisarenko"))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the simulated camera."""
    path = tmp_path_factory.mktemp("offline") / "a.h5"
    with open_camera("sim:mirrors?seed=5", clock=VirtualClock()) as camera:
        applied = camera.configure(Sequence(harmonics=2, zeroth="estimated", exposure_s=5e-4))
        camera.start()
        writer = RecordingWriter(path, Header("id", "name", 1e9, applied, camera.capabilities))
        for _ in range(FRAMES):
            writer.append(camera.read_frame())
        writer.close({})
    return path


def test_complex_products_also_lie_in_parts_that_octave_reads(path: Path, tmp_path: Path) -> None:
    options = BatchOptions(("moments", "range"))
    with Recording(path) as recording:
        reconstruct_recording(recording, tmp_path / "p.h5", options)
        reconstruct_recording(recording, tmp_path / "p.npz", options)

    with h5py.File(tmp_path / "p.h5") as file, np.load(tmp_path / "p.npz") as archive:
        for found in (file, archive):
            assert {name for name in found if name.endswith(("_re", "_im"))} == {
                "moments_re",
                "moments_im",
            }
            whole = found["moments_re"][()] + 1j * found["moments_im"][()]
            np.testing.assert_array_equal(whole, found["moments"][()])
        assert file["moments_re"].shape[0] == FRAMES


@needs_octave
def test_octave_reads_images_weights_and_gains_as_the_page_says(path: Path, tmp_path: Path) -> None:
    shutil.copy(path, tmp_path / "corner.h5")
    page = (ROOT / "docs" / "recordings.md").read_text("utf-8")
    (block,) = re.findall(r"^```octave\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    rest = """weight = complex(d.weight_re, d.weight_im);
        save('-v6', 'o.mat', 'images', 'gain', 'weight')"""
    done = subprocess.run(
        ["octave-cli", "--quiet", "--norc", "--eval", block + rest],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )

    assert (done.returncode, done.stderr) == (0, "")
    found = scipy.io.loadmat(tmp_path / "o.mat")
    with h5py.File(path) as file:
        np.testing.assert_array_equal(found["images"].T, file["raw"][0])
        np.testing.assert_array_equal(found["weight"].T, file["weight"][()])
        np.testing.assert_array_equal(found["gain"].ravel(), file["gain"][()])


def test_a_frame_has_one_number_wherever_it_is_read(path: Path, tmp_path: Path) -> None:
    numbers = list(range(1, FRAMES + 1))
    with Recording(path) as recording:
        reconstruct_recording(recording, tmp_path / "p.npz", QUICK)
        convert_recording(recording, tmp_path / "r.npz")
        stored = np.frombuffer(ZarrKeys(recording).value("frame/0"), "<u8")[:FRAMES]

    with h5py.File(path) as file, transientcam.open(path) as opened:
        dataset = opened.to_xarray()
        assert [each.number for each in opened] == numbers
        assert [each.meta["frame"] for each in opened] == numbers
        assert [each.index + 1 for each in opened] == numbers
        assert "RecordedFrame 1:" in repr(opened[0])
        files = [np.load(tmp_path / name)["frame"] for name in ("p.npz", "r.npz")]
        for found in (file["frame"], dataset["frame"], stored, *files):
            assert np.asarray(found).tolist() == numbers
        assert file["device_frame"][()].tolist() == dataset["device_frame"].values.tolist()


def test_numbers_of_an_older_file_count_from_1_and_its_counter_is_kept(
    path: Path, tmp_path: Path
) -> None:
    old = Path(shutil.copy(path, tmp_path / "old.h5"))
    with h5py.File(old, "r+") as file:
        del file["device_frame"]
        file["frame"][:] = [40, 41, 43, 44]

    with Recording(old) as recording:
        assert recording.series("frame").tolist() == [1, 2, 3, 4]
        assert recording.series("device_frame").tolist() == [40, 41, 43, 44]
        assert recording.frame(2).number == 43


def test_products_are_those_the_service_computes(path: Path, tmp_path: Path) -> None:
    output = tmp_path / "products.h5"
    with Recording(path) as recording:
        assert reconstruct_recording(recording, output, BatchOptions()) == 0
        raw = recording.frame(2)
        recipe = Recipe(recording.header.applied, ReconstructionSettings(), 4095.0)

    found = recipe.reconstruct(raw)
    with h5py.File(output) as file:
        for name in DEFAULT_PRODUCTS:
            product = PRODUCTS[name]
            expected = product.compute(recipe, found, EVERYTHING)
            np.testing.assert_array_equal(file[name][2], expected)
            assert file[name].attrs["units"] == product.description.unit
        assert len(file["range"]) == FRAMES
        np.testing.assert_array_equal(file["frame"][()], np.arange(1, FRAMES + 1))


def test_a_transient_has_the_times_of_flight_asked_for(path: Path, tmp_path: Path) -> None:
    with Recording(path) as recording:
        reconstruct_recording(
            recording, tmp_path / "t.h5", replace(QUICK, products=("transient",), bins=8)
        )
        base_frequency_hz = recording.header.applied.sequence.base_frequency_hz

    with h5py.File(tmp_path / "t.h5") as file:
        assert file["transient"].shape == (FRAMES, 8, 120, 163)
        assert file["transient"].dims[1][0].name == "/time"
        np.testing.assert_allclose(file["time"][()], np.arange(8) / 8 / base_frequency_hz)


def test_an_interrupted_run_is_gone_on_with_and_ends_the_same(path: Path, tmp_path: Path) -> None:
    class Interruption(Exception):  # noqa: N818 - none is a mistake
        pass

    def interrupt(done: int, total: int) -> None:
        if done == 2:
            raise Interruption

    whole, resumed = tmp_path / "whole.h5", tmp_path / "resumed.h5"
    with Recording(path) as recording:
        reconstruct_recording(recording, whole, QUICK)
        with pytest.raises(Interruption):
            reconstruct_recording(recording, resumed, QUICK, progress=interrupt)
        assert not resumed.exists()
        assert reconstruct_recording(recording, resumed, QUICK) == 2

    assert sorted(each.name for each in tmp_path.iterdir()) == ["resumed.h5", "whole.h5"]
    with h5py.File(whole) as one, h5py.File(resumed) as other:
        assert dict(one.attrs) == dict(other.attrs)
        for name in one:
            np.testing.assert_array_equal(one[name][()], other[name][()])


def test_a_run_that_a_full_disk_ended_is_gone_on_with(path: Path, tmp_path: Path) -> None:
    output, options = tmp_path / "a.h5", replace(QUICK, products=("range",))
    with Recording(path) as recording:
        with FailingDisk(Fault()).inserted() as disk:
            reconstruct_recording(recording, output, options)
        output.unlink()
        for at, left in ((1, []), (disk.calls - 15, ["a.h5.part"])):
            with (
                FailingDisk(Fault(at, "ENOSPC", for_ever=True)).inserted(),
                pytest.raises(OSError, match="No space left on device"),
            ):
                reconstruct_recording(recording, output, options)
            assert [each.name for each in tmp_path.iterdir()] == left
        assert reconstruct_recording(recording, output, options) < recording.frames

    with h5py.File(output) as file:
        assert len(file["range"]) == FRAMES
        assert np.isfinite(file["range"][()]).any(axis=(1, 2)).all()


def test_what_was_begun_otherwise_is_not_gone_on_with(path: Path, tmp_path: Path) -> None:
    output = tmp_path / "a.h5"

    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with Recording(path) as recording:
        with pytest.raises(KeyboardInterrupt):
            reconstruct_recording(recording, output, QUICK, progress=interrupt)
        other = replace(QUICK, settings=QUICK.settings.model_copy(update={"bias": 0.01}))
        with pytest.raises(InputError, match=r"reconstruction is .*0\.004.*0\.01"):
            reconstruct_recording(recording, output, other)
        reconstruct_recording(recording, output, QUICK)
        with pytest.raises(FileExistsError):
            reconstruct_recording(recording, output, QUICK)


def test_the_calibration_that_was_recorded_is_used(path: Path, tmp_path: Path) -> None:
    with Recording(path) as recording:
        header, frames = recording.header, list(recording)
    gains = np.full((3, 120, 163), 2.0, np.complex64)
    bad = np.zeros((120, 163), dtype=np.bool_)
    calibrated = tmp_path / "calibrated.h5"
    writer = RecordingWriter(
        calibrated,
        Header(
            "id",
            "name",
            1e9,
            header.applied,
            header.capabilities,
            calibration={"id": "of this camera"},
            calibration_planes=gains,
            calibration_bad=bad,
        ),
    )
    writer.append(frames[0])
    writer.close({})
    with Recording(calibrated) as recording:
        reconstruct_recording(recording, tmp_path / "out.h5", BatchOptions(products=("moments",)))

    settings = ReconstructionSettings().for_moments(
        base_frequency_hz=header.applied.sequence.base_frequency_hz,
        zeroth="estimated",
        takes=1,
        full_scale=4095.0,
    )
    expected = tm.reconstruct(frames[0].images, settings, calibration=gains, bad_pixels=bad)
    with h5py.File(tmp_path / "out.h5") as file:
        np.testing.assert_array_equal(file["moments"][0], expected.moments)
