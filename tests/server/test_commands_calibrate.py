"""`transientcam calibrate`, through the command line of the client."""

import json
from pathlib import Path

import pytest

from transientcam.cli import run
from transientcam_driver import CalibrationCapture

CAMERA = ["--camera", "sim:calibration?device=prototype"]
QUICK = '{"harmonics": 2, "zeroth": "estimated", "exposure_s": 0.0005}'


def test_a_measurement_is_captured_kept_and_described(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "c.npz"

    code = run(["calibrate", *CAMERA, "--takes", "4", "--sequence", QUICK, "-o", str(out)])

    assert code == 0
    capture = CalibrationCapture.load(out)
    assert (capture.sequence.harmonics, capture.sequence.zeroth) == (2, "estimated")
    assert capture.kept.shape == (4, 8)
    said = capfd.readouterr().out
    assert capture.id in said
    assert "163 x 120 pixels of SIM-prototype-0" in said


def test_the_result_is_printed_as_json(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out, sequence = tmp_path / "c.npz", tmp_path / "sequence.json"
    sequence.write_text(QUICK)

    arguments = ["--takes", "2", "--sequence", str(sequence), "-o", str(out), "--json"]
    assert run(["calibrate", *CAMERA, *arguments]) == 0

    result = json.loads(capfd.readouterr().out)
    assert result["calibration_id"] == CalibrationCapture.load(out).id
    assert (result["images"], result["takes"]) == (8, 2)
    assert result["sequence"]["harmonics"] == 2


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--takes", "1"], 2, "takes"),
        (["--sequence", "{"], 2, "sequence"),
        (["--sequence", '{"harmonics": 99}'], 1, "harmonics"),
        (["--sequence", "absent.json"], 1, "absent.json"),
        (["--camera", "webcam"], 1, "webcam"),
        (["-o", "/nowhere/c.npz"], 2, "/nowhere"),
    ],
)
def test_what_cannot_be_done_is_said_and_nothing_written(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    message: str,
) -> None:
    out = tmp_path / "c.npz"

    assert run(["calibrate", *CAMERA, "-o", str(out), *arguments]) == code
    assert message in capfd.readouterr().err
    assert not out.exists()
