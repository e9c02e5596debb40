"""A camera of another distribution: found, opened, held to the contract, served, checked."""

import json
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from tests.server.camera.plug_in import block, install
from tests.serving import Served, serving
from transientcam import Camera
from transientcam.cli import findings, run as command
from transientcam.errors import ProblemError
from transientcam_conformance import Device, Report, chosen, run as check
from transientcam_driver import CameraNotFound, SpecError, open_camera
from transientcam_driver.contract import CLAUSES, Bench, Clause, ContractSkipped

DISTANCE_M = 2.5
FAR_M = 12.5
PROJECT = Path(__file__).parents[3] / "pyproject.toml"
OF_CONSECUTIVE_MULTIPLES = (
    *("validity", "range_bias", "range_error", "trust", "coefficients", "transient", "density_std"),
    *("cumulative", "streak", "bounds"),
)
# the others record, replay, or wait for long; they do not depend on the camera
GROUPS = ("parameters", "tags")


@pytest.fixture(scope="module", autouse=True)
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(install(tmp_path_factory.mktemp("plug-in"))))
        yield
        sys.modules.pop("wall_camera", None)


def check_groups(daemon: Served, *groups: str) -> Report:
    with Device(daemon.url, timeout_s=60.0) as device:
        return check(device, chosen(groups, quick=True))


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
    assert found["an-unplugged-camera-is-lost-and-comes-back"]["level"] == "not tried"

    assert command(["doctor", "--camera", f"wall:{wall}.gone", "--json"]) == 1
    faults = json.loads(capsys.readouterr().out)
    assert faults["verdict"] == "fault"


def of_products(printed: str) -> dict[str, str]:
    """Return the reasons that `doctor --json` gives, by the products that are absent."""
    found = json.loads(printed)["findings"]
    messages = [each["message"] for each in found if each["check"] == "products"]
    return dict(each.removeprefix("no ").split(": ", 1) for each in messages)


@pytest.mark.parametrize("frequencies", ["free", "fixed"])
def test_the_doctor_lists_what_it_cannot_give(
    wall: Path,
    frequencies: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    offered = tomllib.loads(PROJECT.read_text())["project"]["entry-points"][findings.CAMERA_GROUP]
    server = EntryPoint("server", offered["server"], findings.CAMERA_GROUP)
    monkeypatch.setattr(findings, "entry_points", lambda group: [server])

    assert command(["doctor", "--camera", f"wall:{wall}?frequencies={frequencies}", "--json"]) == 0
    reasons = of_products(capsys.readouterr().out)
    assert command(["doctor", "--camera", f"wall:{wall}.gone", "--json"]) == 1

    assert "can do cannot be read" in capsys.readouterr().out
    assert reasons.pop("truth, direct_share") == "only a simulated camera knows the true range"
    if frequencies == "free":
        assert not reasons
    else:
        assert set(reasons) == {"uniform, brightness", ", ".join(OF_CONSECUTIVE_MULTIPLES)}
        assert all(
            "this camera measures the multiples 2, 10 and 15" in why for why in reasons.values()
        )


def test_its_daemon_measures_the_distance_and_passes_the_checks(wall: Path) -> None:
    with serving(f"wall:{wall}", sequence={"base_frequency_hz": 20e6}) as daemon:
        with Camera(daemon.url, timeout_s=60.0) as client:
            frame = client.frame("range", wait_s=10.0)
            with pytest.raises(ProblemError, match="only a simulated camera knows the true range"):
                client.frame("truth")
            absent = {each["name"]: each["reason"] for each in client.info["absent_products"]}
        report = check_groups(daemon, *GROUPS)

    assert frame.array == pytest.approx(DISTANCE_M, abs=2e-3)
    why = "only a simulated camera knows the true range"
    assert absent == {"truth": why, "direct_share": why}
    assert not report.failed, [(each.check.name, each.reason) for each in report.failed]


@pytest.fixture(scope="module")
def fixed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A daemon with the camera of 16, 80 and 120 MHz, beyond the period of 16 MHz."""
    directory = tmp_path_factory.mktemp("fixed")
    (directory / "wall.txt").write_text(str(FAR_M))
    kept = {"directory": directory, "min_free_bytes": 0}
    with serving(f"wall:{directory / 'wall.txt'}?frequencies=fixed", recordings=kept) as daemon:
        daemon.start_all_workers()
        yield daemon


def test_fixed_frequencies_measure_the_distance(fixed: Served) -> None:
    with Camera(fixed.url, timeout_s=60.0) as client:
        sequence, frame = client.sequence, client.frame("range", wait_s=10.0)
        moments = client.frame("moments")
        report = check_groups(fixed, *GROUPS)

    assert frame.array == pytest.approx(FAR_M, abs=2e-3)
    assert sequence["images"] == 9
    assert sequence["sampling"]["multiples"] == [2, 10, 15]
    assert moments.frequencies_hz == (0, 16e6, 80e6, 120e6)
    turns = np.angle(moments.array[1:]) / (2 * np.pi)
    expected = np.array([16e6, 80e6, 120e6]) * 2 * FAR_M / 299_792_458.0
    apart = (turns - expected[:, None, None] + 0.5) % 1 - 0.5
    assert np.abs(apart).max() < 1e-3
    assert not report.failed, [(each.check.name, each.reason) for each in report.failed]


@pytest.mark.parametrize("estimator", ["two-returns", "unwrapped-phase"])
def test_their_estimators_state_range_and_deviation(fixed: Served, estimator: str) -> None:
    with Camera(fixed.url, timeout_s=60.0) as client:
        client.reconstruction = {"estimator": estimator}
        newest = client.reconstruction["reconstruction_id"]
        frame = client.frame("range", after=client.latest(wait_s=10.0)["frame"], wait_s=10.0)
        while frame.meta["reconstruction_id"] < newest:  # the frames on their way are older
            frame = client.frame("range", after=frame.meta["frame"], wait_s=10.0)
        std = client.frame("range_std").array
        client.reconstruction = {"estimator": "automatic"}

    assert frame.meta["estimator"] == estimator
    assert frame.array == pytest.approx(FAR_M, abs=2e-3)
    assert ((std > 0) & (std < 0.05)).all()


def test_what_they_cannot_give_is_absent_with_the_reason(
    fixed: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with Camera(fixed.url, timeout_s=60.0) as client:
        absent = {each["name"]: each["reason"] for each in client.info["absent_products"]}
        with client.stream("validity") as frames, pytest.raises(ProblemError, match="2, 10 and 15"):
            next(iter(frames))
        with pytest.raises(ProblemError, match="multiples 2, 10 and 15"):
            client.reconstruction = {"estimator": "pisarenko"}
        estimator = client.reconstruction["estimator"]

    with Device(fixed.url, timeout_s=60.0) as device:
        refused = device.send("POST", "/api/v1/plan", json={"target": {"range_error_m": 0.01}})
        problem = device.refusal(refused, 409, "target-unreachable")
        front = device.refusal(device.send("GET", "/api/v1/tradeoff"), 409, "target-unreachable")
        pixel = device.send("GET", "/api/v1/frames/latest/pixel", params={"x": 1, "y": 1})
    curves = pixel.json()

    assert problem["field"] == front["field"] == "sampling"
    assert problem["takes"] == front["takes"] == []  # nobody states the noise of its sensor
    assert curves["density_per_s"] == curves["cumulative"] == []
    assert len(curves["returns"]) > 0
    assert "the multiples 2, 10 and 15 at 3" in problem["detail"]
    assert set(absent) == {
        *OF_CONSECUTIVE_MULTIPLES,
        "brightness",
        "uniform",
        "truth",
        "direct_share",
    }
    assert command(["doctor", fixed.url, "--seconds", "0.1", "--json"]) == 0
    printed = of_products(capsys.readouterr().out)
    assert {name: why for names, why in printed.items() for name in names.split(", ")} == absent
    assert "needs consecutive multiples of one frequency" in absent["transient"]
    assert "needs a zeroth moment" in absent["brightness"]
    assert estimator == "automatic"


def test_their_recordings_are_reconstructed_and_replayed(
    fixed: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    with Camera(fixed.url, timeout_s=60.0) as client:
        client.frame("flags", wait_s=10.0)  # there is a frame to begin with
        recording = client.stop_recording(client.record(history_s=60.0)["id"])["id"]
        path = f"/api/v1/recordings/{recording}/frames/1/range"
        with Device(fixed.url, timeout_s=60.0) as device:
            recorded = device.frame(path)
            file = device.send("GET", f"/api/v1/recordings/{recording}/file").content
    copy = fixed.settings.recordings.directory / "copy.h5"
    copy.write_bytes(file)
    with serving(f"recording:{copy}") as replay, Camera(replay.url, timeout_s=60.0) as client:
        replayed = client.frame("range", wait_s=10.0)
    products = copy.with_name("products.npz")
    again = ["reconstruct", str(copy), "-o", str(copy.with_name("again.npz"))]
    assert command(["reconstruct", str(copy), "-o", str(products)]) == 0

    with np.load(products) as computed:
        assert computed["range"] == pytest.approx(FAR_M, abs=2e-3)
        assert not {"validity", "brightness"} & set(computed)
    assert command([*again, "--product", "validity"]) == 1
    assert "2, 10 and 15" in capsys.readouterr().err
    assert recorded.array == pytest.approx(FAR_M, abs=2e-3)
    assert replayed.array == pytest.approx(FAR_M, abs=2e-3)


def test_the_example_is_short() -> None:
    assert len(block("python").splitlines()) < 150
