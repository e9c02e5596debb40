import json
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from zarr.core.sync import cleanup_resources

from tests.moments.gpu_devices import software_device
from tests.server.recording.made import APPLIED, record
from transientcam.cli import run
from transientcam_moments import _gpu
from transientcam_server import offline


@pytest.fixture(autouse=True)
def compiled_for(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Compile nothing, and return the orders that were to be compiled for."""
    orders: list[int] = []
    take = lambda recipe: orders.append(recipe.applied.sequence.harmonics)  # noqa: E731
    monkeypatch.setattr(offline, "load_kernels", take)
    return orders


def test_kernels_are_compiled_first_so_that_each_run_gives_the_same_bits(
    tmp_path: Path, compiled_for: list[int]
) -> None:
    source = record(tmp_path / "a.h5", 1)
    assert run(["reconstruct", str(source), "-o", str(tmp_path / "b.h5")]) == 0
    assert compiled_for == [APPLIED.sequence.harmonics]


def test_reconstruct_takes_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = record(tmp_path / "a.h5", 2)
    output = tmp_path / "products.h5"

    command = ["reconstruct", str(source), "-o", str(output)]
    assert run([*command, "--product", "range", "--product", "flags", "--json"]) == 0
    document = {"file": str(output), "products": ["range", "flags"], "frames": 2, "before": 0}
    assert json.loads(capsys.readouterr().out) == document
    with h5py.File(output) as file:
        assert file["range"].shape == (2, 12, 16)
        assert "direct" not in file
    assert run([*command, "--product", "colour"]) == 2
    assert "'colour' is none of" in capsys.readouterr().err
    assert run([*command, "--product", "density_std"]) == 2


@pytest.mark.parametrize("suffix", ["npz", "nc", "zarr"])
def test_products_are_written_as_the_suffix_says(tmp_path: Path, suffix: str) -> None:
    source, plain = record(tmp_path / "a.h5", 2), tmp_path / "plain.h5"
    output = tmp_path / f"products.{suffix}"
    of = ["--product", "range", "--product", "transient", "--product", "moments", "--bins", "3"]

    assert run(["reconstruct", str(source), "-o", str(plain), *of]) == 0
    assert run(["reconstruct", str(source), "-o", str(output), *of]) == 0

    with h5py.File(plain) as file:
        expected = {name: file[name][()] for name in ("range", "transient", "moments", "frame")}
        title = file.attrs["title"]
    if suffix == "npz":
        with np.load(output) as archive:
            found = {name: archive[name] for name in expected}
            assert str(archive["title"]) == title
    else:
        engine = "zarr" if suffix == "zarr" else "h5netcdf"
        with xarray.open_dataset(output, engine=engine) as dataset:
            found = {name: dataset[name].to_numpy() for name in expected}
            assert dataset["transient"].dims == ("frame", "time", "y", "x")
            assert dataset["range"].attrs["units"] == "m"
        cleanup_resources()  # ends the threads of zarr
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
    assert not list(tmp_path.glob("*.part"))


def test_another_suffix_is_refused_before_anything_is_computed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = record(tmp_path / "a.h5", 1)

    assert run(["reconstruct", str(source), "-o", str(tmp_path / "a.mat")]) == 1
    assert ".h5, .hdf5, .nc, .npz, .zarr" in capsys.readouterr().err
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]


def test_a_recording_is_reconstructed_with_what_was_recorded_unless_settings_are_given(
    tmp_path: Path,
) -> None:
    source = record(tmp_path / "a.h5", 1, reconstruction={"bias": 0.05, "smoothing_px": 0.9})
    one, other = tmp_path / "one.h5", tmp_path / "other.h5"

    assert run(["reconstruct", str(source), "-o", str(one)]) == 0
    given = ["--smoothing-px", "0", "--estimator", "pisarenko"]
    assert run(["reconstruct", str(source), "-o", str(other), *given]) == 0

    with h5py.File(one) as file:
        settings = json.loads(file.attrs["reconstruction"])
        assert (settings["bias"], settings["smoothing_px"]) == (0.05, 0.9)
    with h5py.File(other) as file:
        settings = json.loads(file.attrs["reconstruction"])
        assert (settings["bias"], settings["smoothing_px"]) == (0.05, 0.0)
        assert settings["estimator"] == "pisarenko"


def test_a_device_computes_the_frames_of_a_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = record(tmp_path / "r.h5", frames=2)
    given = ["reconstruct", str(recording), "--estimator", "pisarenko", "--product", "range"]
    with software_device("llvmpipe") as device:
        monkeypatch.setattr(_gpu, "device_of", lambda name: device)
        assert run([*given, "-o", str(tmp_path / "gpu.npz"), "--device", "gpu"]) == 0
        assert device.frames >= 2
    monkeypatch.undo()
    monkeypatch.setattr(offline, "load_kernels", lambda recipe: None)
    assert run([*given, "-o", str(tmp_path / "cpu.npz")]) == 0

    there, here = (np.load(tmp_path / f"{name}.npz")["range"] for name in ("gpu", "cpu"))
    assert np.isclose(there, here, atol=1e-3, equal_nan=True).mean() > 0.98


def test_without_a_gpu_one_sentence_says_what_was_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    software = [_gpu.Adapter("llvmpipe", "CPU", "Vulkan", "1.0")]
    monkeypatch.setattr(_gpu.Device, "_adapters", lambda self: software)
    monkeypatch.setattr(_gpu, "device_of", lambda name: _gpu.Device(name))
    recording, out = record(tmp_path / "r.h5", frames=1), tmp_path / "out.npz"

    code = run(["reconstruct", str(recording), "-o", str(out), "--device", "gpu"])

    said = "transientcam: device = 'gpu' cannot be used: llvmpipe computes on the processor\n"
    assert (code, capsys.readouterr().err, out.exists()) == (1, said, False)


def test_another_device_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = record(tmp_path / "r.h5", frames=1)

    code = run(["reconstruct", str(recording), "-o", str(tmp_path / "o.npz"), "--device", "cuda"])

    assert code == 1
    assert "cpu, auto, gpu or gpu:NAME" in capsys.readouterr().err
