"""`transientcam calibrate`, through the command line of the client."""

import json
import threading
from pathlib import Path

import pytest

from tests.serving import serving
from transientcam.cli import run
from transientcam_driver import CalibrationCapture
from transientcam_server.daemon._configuration import load_settings

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
    assert run(["calibrate", "--camera", "sim:calibration", *arguments]) == 0

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
    tmp_path: Path, capfd: pytest.CaptureFixture[str], arguments: list[str], code: int, message: str
) -> None:
    out = tmp_path / "c.npz"

    assert run(["calibrate", *CAMERA, "-o", str(out), *arguments]) == code
    assert message in capfd.readouterr().err
    assert not out.exists()


def test_one_of_a_scene_is_kept_but_served_only_if_forced(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    kept, forced = tmp_path / "kept.npz", tmp_path / "forced.npz"
    scene = ["calibrate", "--camera", "sim:mirrors?noise=off", "--takes", "2"]

    assert run([*scene, "-o", str(kept)]) == 1
    assert "this is a scene, not a diffuser" in capfd.readouterr().out
    assert run([*scene, "-o", str(forced), "--force"]) == 0

    capfd.readouterr()
    serve = ["serve", "--check", "--camera", "sim:mirrors", "--calibration"]
    assert run([*serve, str(kept)]) != 0
    assert "not measured on a diffuser" in capfd.readouterr().err
    assert run([*serve, str(forced)]) == 0


@pytest.mark.parametrize("spelling", ["--diffuser", "--diffusor"])
def test_the_diffuser_is_put_before_a_simulated_lens(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], spelling: str
) -> None:
    out = ["--sequence", QUICK, "--takes", "2", "-o", str(tmp_path / "c.npz"), spelling]

    assert run(["calibrate", "--camera", "sim:mirrors", *out]) == 0
    assert "measured on a diffuser" in capfd.readouterr().out
    assert run(["calibrate", "--camera", "usb", *out]) == 2


def test_the_noise_of_the_sensor_becomes_settings(tmp_path: Path) -> None:
    settings = tmp_path / "transientcam.toml"
    noise = ["calibrate", "--noise", "--camera", "sim:wall", "--takes", "4"]

    assert run([*noise, "-o", str(settings)]) == 0

    assert "# system_gain_dn_per_e = 0.1" in settings.read_text()  # 9 e/DN
    sensor = load_settings({}, file=settings, environment={}).sensor
    assert sensor.gain_e_per_dn == pytest.approx(9.0, rel=0.05)
    assert sensor.model_fields_set == {"gain_e_per_dn", "full_well_e", "read_noise_e", "dark_dn"}
    assert run(["calibrate", "--noise", "http://127.0.0.1:1"]) == 2


# -- where a daemon has the camera -----------------------------------------------------------------


def test_a_daemon_measures_keeps_uses_and_exports_one(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "c.npz"
    with serving("sim:calibration") as daemon:
        arguments = ["--name", "warm", "--takes", "3", "--activate", "-o", str(out)]
        assert run(["calibrate", daemon.url, *arguments]) == 0
        active = daemon.service.calibrations.active_id

    assert CalibrationCapture.load(out).id == active
    said = capfd.readouterr().out
    assert f"{active} (warm)" in said
    assert "163 x 120 pixels of SIM-ideal-0" in said
    assert "harmonics of the modulation are not known: a phase sweep needs" in said
    assert "in use" in said


def test_what_a_daemon_measured_is_printed_as_json(capfd: pytest.CaptureFixture[str]) -> None:
    with serving("sim:calibration") as daemon:
        assert run(["calibrate", daemon.url, "--takes", "2", "--json"]) == 0

    result = json.loads(capfd.readouterr().out)
    assert result["measured"]["calibration"] == result["calibration"]["id"]
    assert result["file"] is None
    assert not result["calibration"]["active"]


def test_in_a_daemon_one_of_a_scene_is_not_used_and_the_diffuser_and_undo_are_at_hand(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with serving("sim:wall?noise=off") as daemon:
        measure = ["calibrate", daemon.url, "--takes", "2", "--activate"]
        assert run(measure) == 1
        assert "this may be no diffuser" in capfd.readouterr().out
        assert daemon.service.calibrations.active_id == "nominal"
        assert run([*measure, "--diffuser"]) == 0
        simulation = daemon.service.camera.simulation
        assert simulation is not None
        assert not simulation.diffuser
        measured = daemon.service.calibrations.active_id
        assert measured != "nominal"
        assert run(["calibrate", daemon.url, "--undo"]) == 0
        assert f"not {measured}" in capfd.readouterr().out
        assert daemon.service.calibrations.active_id == "nominal"


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["--undo"], "--undo"),
        (["http://127.0.0.1:1", "--camera", "usb"], "--camera"),
        (["http://127.0.0.1:1", "--sequence", "{}"], "--sequence"),
        (["--activate", "-o", "c.npz"], "--activate"),
        (["--name", "warm", "-o", "c.npz"], "--name"),
        (["--camera", "sim:calibration"], "--output"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    capfd: pytest.CaptureFixture[str], arguments: list[str], hint: str
) -> None:
    assert run(["calibrate", *arguments]) == 2
    assert hint in capfd.readouterr().err


def test_a_daemon_that_cannot_measure_says_why(capfd: pytest.CaptureFixture[str]) -> None:
    with serving("sim:calibration") as daemon:
        end = threading.Event()
        acquisition = daemon.service.acquisition
        acquisition.occupy("another", lambda _, go_on: end.wait(), offs=acquisition.offs)
        code = run(["calibrate", daemon.url])
        end.set()

    assert code == 1
    assert "another has the camera" in capfd.readouterr().err
