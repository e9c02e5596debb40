"""The notebooks run from a clean state, before one daemon, and what they show is right."""

import importlib.util
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from unittest import mock

import marimo
import numpy as np
import pytest
from matplotlib import pyplot as plt

from tests.conftest import ROOT
from tests.server.planning.calls import Here
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import Camera
from transientcam.player_widget import PlayerWidget

_NOTEBOOKS = ROOT / "notebooks"
_C_M_S = 299_792_458.0


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as daemon, Camera(daemon.url, timeout_s=60.0) as camera:
        daemon.start_all_workers()  # later they would look like threads that a test left behind
        camera.sequence = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
        with camera.stream("range") as stream:
            stream.receive()
        # its own process has the lowest priority, and waits for all that a laden machine does
        with mock.patch.object(daemon.service.planning, "_process", Here()):
            yield daemon


@pytest.fixture(autouse=True)
def no_figures_left() -> Iterator[None]:
    with plt.rc_context({"backend": "agg"}):
        yield
        plt.close("all")


def run(name: str, **definitions: Any) -> tuple[list[Any], dict[str, Any]]:
    """Return outputs of the cells and what they define; ``definitions`` take the place of cells."""
    spec = importlib.util.spec_from_file_location(name, _NOTEBOOKS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert isinstance(module.app, marimo.App)
    outputs, defined = module.app.run(defs=definitions)
    return [each for each in outputs if each is not None], dict(defined)


def test_every_notebook_is_run_here() -> None:
    assert {path.name for path in _NOTEBOOKS.glob("*.py")} == {
        "direct_and_indirect.py",
        "light_in_flight.py",
        "plan_by_accuracy.py",
        "your_own_measurement.py",
    }


def test_light_in_flight(served: Served) -> None:
    outputs, found = run("light_in_flight", url=served.url)

    with closing(found["camera"]):
        # light arrives where the range of the first return says
        brightest_s = found["time_s"][np.argmax(found["response"])]
        assert brightest_s * _C_M_S / 2.0 == pytest.approx(found["range_m"], abs=0.1)
        (shown,) = (each for each in outputs if isinstance(each, PlayerWidget))
        assert shown.shape["width"] == 163


def test_direct_and_indirect(served: Served) -> None:
    _, found = run("direct_and_indirect", url=served.url)

    with closing(found["camera"]):
        share = found["share"]
        assert np.nanmin(share) >= 0.0
        assert np.nanmax(share) <= 1.0
        # one frequency is pulled behind the first return by what arrives later
        assert np.nanmedian(found["difference_m"]) > 0.0


def test_plan_by_accuracy(served: Served) -> None:
    restrictions = {"fixed": {"base_frequency_hz": 23e6, "harmonics": 3}, "estimator": "pisarenko"}
    _, found = run(
        "plan_by_accuracy", url=served.url, targets_m=(0.03, 1e-9), restrictions=restrictions
    )

    reached, beyond = found["plans"][0.03], found["plans"][1e-9]
    assert reached["predicted"]["range_error_m"]["median"] <= 0.03
    assert reached["sequence"]["harmonics"] == 3
    assert beyond["type"] == "/problems/target-unreachable"
    with Camera(served.url, timeout_s=60.0) as camera:
        assert camera.sequence["sequence_id"] == found["present"]["sequence_id"]


def test_your_own_measurement() -> None:
    outputs, found = run("your_own_measurement")

    # the sample in closed form: the first return is the wall, however strong the mirror's is
    way_m = np.add.outer(np.linspace(2.0, 3.0, 30), np.linspace(0.0, 1.0, 40))
    bin_m = 0.02
    np.testing.assert_allclose(found["range_m"], way_m / 2.0, atol=bin_m / 4.0 + 0.005)
    (shown,) = (each for each in outputs if isinstance(each, PlayerWidget))
    assert shown.shape["harmonics"] == 8


def test_your_own_file_and_recording(tmp_path: Path, served: Served) -> None:
    path = tmp_path / "own.npz"
    moments = np.exp(2j * np.pi * 20e6 * np.arange(4) * 10e-9).reshape(4, 1, 1)
    np.savez(path, moments=moments, base_frequency_hz=20e6)
    with Camera(served.url, timeout_s=60.0) as camera:
        started = camera.record(frames=2)
        wait_until(lambda: camera.recording(started["id"])["state"] == "complete")
        camera.download_recording(started["id"], tmp_path / "own.h5")
        wanted = camera.frame("range", recording=started["id"], number=1).array

    _, found = run(
        "your_own_measurement",
        path=path,
        frequency_hz=20e6,
        harmonics=3,
        recording_path=tmp_path / "own.h5",
    )

    with closing(found["recording"]):
        np.testing.assert_allclose(found["range_m"], 10e-9 * _C_M_S / 2.0, rtol=1e-3)
        np.testing.assert_allclose(found["first_range"].array, wanted, rtol=1e-5)
