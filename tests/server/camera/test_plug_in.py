"""A camera of another distribution: found, opened, held to the contract, served, checked."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.server.camera.plug_in import block, install
from tests.serving import serving
from transientcam import Camera
from transientcam.cli import run as command
from transientcam.conformance import Device, chosen
from transientcam.conformance import run as check
from transientcam.errors import ProblemError
from transientcam_driver import CameraNotFound, SpecError, open_camera
from transientcam_driver.contract import CLAUSES, Bench, Clause, ContractSkipped

DISTANCE_M = 2.5
# the others record, replay, or wait for long; they do not depend on the camera
GROUPS = ("parameters", "tags")


@pytest.fixture(scope="module", autouse=True)
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(install(tmp_path_factory.mktemp("plug-in"))))
        yield
        sys.modules.pop("wall_camera", None)


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    file = tmp_path / "wall.txt"
    file.write_text(str(DISTANCE_M))
    return file


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda each: each.name)
def test_it_keeps_the_contract(wall: Path, clause: Clause) -> None:
    spec = f"wall:{wall}"

    def replug(camera: object) -> None:
        wall.write_text(str(DISTANCE_M))

    bench = Bench(lambda: open_camera(spec), unplug=lambda camera: wall.unlink(), replug=replug)
    if clause.name == "lost-images-are-counted":
        with pytest.raises(ContractSkipped):  # this device loses none
            clause.run(bench)
    else:
        clause.run(bench)


def test_it_is_listed_and_its_names_are_checked(
    wall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["devices", "--no-network", "--json"]) == 0
    kinds = {each["name"]: each for each in json.loads(capsys.readouterr().out)["kinds"]}

    assert kinds["wall"]["usage"] == "wall:FILE"
    with pytest.raises(SpecError, match="unknown option 'speed'"):
        open_camera(f"wall:{wall}?speed=3")
    with pytest.raises(CameraNotFound, match=r"absent\.txt"):
        open_camera(f"wall:{wall.parent}/absent.txt")


def test_the_doctor_reports_on_it(wall: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["doctor", "--camera", f"wall:{wall}", "--json"]) == 0
    found = {each["check"]: each for each in json.loads(capsys.readouterr().out)["findings"]}

    assert found["camera"]["message"] == "wall wall.txt, firmware 1.0"
    assert "64" in found["can do"]["message"]
    assert found["stop-is-dark-and-start-goes-on"]["level"] == "ok"
    assert "not tried" in found["an-unplugged-camera-is-lost-and-comes-back"]["message"]

    assert command(["doctor", "--camera", f"wall:{wall}.gone", "--json"]) == 1
    faults = json.loads(capsys.readouterr().out)
    assert faults["verdict"] == "fault"


def test_its_daemon_measures_the_distance_and_passes_the_checks(wall: Path) -> None:
    with serving(f"wall:{wall}", sequence={"base_frequency_hz": 20e6}) as daemon:
        with Camera(daemon.url, timeout_s=60.0) as client:
            frame = client.frame("range")
            with pytest.raises(ProblemError, match="only a simulated camera knows the true range"):
                client.frame("truth")
            absent = {each["name"]: each["reason"] for each in client.info["absent_products"]}
        with Device(daemon.url, timeout_s=20.0) as device:
            report = check(device, chosen(GROUPS, quick=True))

    assert frame.array == pytest.approx(DISTANCE_M, abs=2e-3)
    assert absent == {"truth": "only a simulated camera knows the true range"}
    assert not report.failed, [(each.check.name, each.reason) for each in report.failed]


def test_the_example_is_short() -> None:
    assert len(block("python").splitlines()) < 150
