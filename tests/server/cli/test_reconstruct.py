"""`transientcam reconstruct` and `compile`, through the command line of the client."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from transientcam.cli import run
from transientcam_moments import kernels
from transientcam_server.offline import TransientCube

F_HZ = 23e6


@pytest.fixture
def measurement(tmp_path: Path) -> Path:
    delay_rad = 2.0 * np.pi * F_HZ * np.full((6, 5), 10e-9)
    moments = np.stack([2.0 * np.exp(1j * j * delay_rad) for j in range(5)])
    np.savez(tmp_path / "in.npz", moments=moments, base_frequency_hz=F_HZ)
    return tmp_path / "in.npz"


def test_a_measurement_becomes_a_file_of_everything(
    measurement: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.npz"

    code = run(
        ["reconstruct", str(measurement), "-o", str(out), "--bins", "40", "--harmonics", "3"]
    )

    assert code == 0
    with np.load(out) as file:
        assert set(file) == set(TransientCube.__slots__)
        assert file["density"].shape == (40, 6, 5)
        np.testing.assert_allclose(file["range_m"], 299_792_458.0 * 10e-9 / 2.0, rtol=1e-6)
        np.testing.assert_allclose(file["direct"], 2.0, rtol=1e-5)
        np.testing.assert_allclose(file["uniform"], 0.0, atol=0.01)  # the bias
    said = capfd.readouterr().err
    assert "5 x 6 pixels" in said
    assert "m = 3" in said


def test_a_picture_is_drawn_where_one_is_asked_for(measurement: Path, tmp_path: Path) -> None:
    picture = tmp_path / "a.png"

    code = run(
        ["reconstruct", str(measurement), "-o", str(tmp_path / "out.npz"), "--plot", str(picture)]
    )

    assert code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(["-o", "out.h5"], "out.h5 must end in .npz"), (["-o", "a.npz", "--plot", "a.jpg"], ".png")],
)
def test_a_suffix_of_another_format_is_refused(
    measurement: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], named: str
) -> None:
    assert run(["reconstruct", str(measurement), *arguments]) == 2

    said = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert named in said


def test_flagged_pixels_are_counted(
    measurement: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with np.load(measurement) as file:
        moments = file["moments"]
    moments[1, 2, 3] = np.nan
    np.savez(measurement, moments=moments, base_frequency_hz=F_HZ)

    assert run(["reconstruct", str(measurement), "-o", str(tmp_path / "out.npz")]) == 0
    assert "1 pixels flagged non finite" in capfd.readouterr().err


def test_what_was_reconstructed_is_printed_as_json(
    measurement: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.npz"

    assert run(["reconstruct", str(measurement), "-o", str(out), "--bins", "40", "--json"]) == 0

    document = json.loads(capfd.readouterr().out)
    assert document["file"] == str(out)
    assert (document["width"], document["height"], document["times"]) == (5, 6, 40)
    assert (document["harmonics"], document["base_frequency_hz"]) == (4, F_HZ)
    assert document["flagged"]["non_finite"] == 0


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--harmonics", "9"], 1, "--harmonics"),
        (["--frequency-hz", "5e6"], 1, "--frequency-hz"),
        (["--bias", "0"], 2, "bias"),
        (["--bias", "nan"], 2, "bias"),
        (["--bins", "0"], 2, "bins"),
        (["--smoothing-px", "-1"], 2, "smoothing-px"),
        (["--threshold", "1.5"], 2, "threshold"),
        (["--estimator", "music"], 2, "estimator"),
    ],
)
def test_an_option_that_cannot_be_used_is_named_and_nothing_written(
    measurement: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    message: str,
) -> None:
    out = tmp_path / "out.npz"

    assert run(["reconstruct", str(measurement), "-o", str(out), *arguments]) == code
    assert message in capfd.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize("name", ["absent.npz", "broken.npz", "."])
def test_a_file_that_cannot_be_read_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    (tmp_path / "broken.npz").write_bytes(b"no zip")

    code = run(["reconstruct", str(tmp_path / name), "-o", str(tmp_path / "out.npz")])

    assert code == 1
    said = capfd.readouterr().err
    assert tmp_path.name in said.replace("\n", "")
    assert "Traceback" not in said


def test_an_output_that_cannot_be_written_is_named_and_leaves_no_part(
    measurement: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code = run(["reconstruct", str(measurement), "-o", str(tmp_path / "nowhere" / "out.npz")])

    assert code == 1
    assert "nowhere" in capfd.readouterr().err.replace("\n", "")
    assert [each.name for each in tmp_path.iterdir()] == ["in.npz"]


def test_compiling_reports_what_is_ready(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    asked: list[Any] = []

    def compile_(*, harmonics: list[int], progress: Any) -> None:
        asked.extend(harmonics)
        progress(0, 1, "levinson m=5 float32")
        progress(1, 1, "")

    state = {"enabled": True, "compiled": ["a", "b"], "compiling": None, "failed": []}
    monkeypatch.setattr(kernels, "compile", compile_)
    monkeypatch.setattr(kernels, "state", lambda: state)

    assert run(["compile", "--harmonics", "5", "--harmonics", "6"]) == 0

    assert asked == [5, 6]
    assert "2 kernels are ready" in capfd.readouterr().out


def test_a_kernel_that_cannot_be_compiled_is_named_and_fails_the_command(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    state = {"enabled": True, "compiled": [], "compiling": None, "failed": ["density m=3: no disk"]}
    monkeypatch.setattr(kernels, "compile", lambda **_: None)
    monkeypatch.setattr(kernels, "state", lambda: state)

    assert run(["compile"]) == 1
    assert "density m=3: no disk" in capfd.readouterr().out

    assert run(["compile", "--json"]) == 1
    assert json.loads(capfd.readouterr().out) == state


def test_where_kernels_are_off_there_is_nothing_to_compile(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(kernels, "state", lambda: {"enabled": False})

    assert run(["compile"]) == 0
    assert "NumPy" in capfd.readouterr().out

    assert run(["compile", "--json"]) == 0
    assert json.loads(capfd.readouterr().out) == {"enabled": False}
