"""The daemon takes its range from any technique that keeps up, and says where one cannot."""

from functools import cache
from pathlib import Path
from typing import get_args

import httpx
import numpy as np
import pytest

import transientcam_moments as tm
from tests.serving import serving
from transientcam import Camera
from transientcam_driver import AppliedSequence, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.capture import FrameWithTruth, capture
from transientcam_moments.comparisons import _sra_table as sra_table
from transientcam_moments.reconstruction import OF_ANY_MULTIPLES
from transientcam_server.imaging import Recipe
from transientcam_server.planning._prediction.timing import ReconstructionTimer
from transientcam_server.settings import Estimator, ReconstructionSettings

PATH = "/api/v1/reconstruction"


def test_the_daemon_offers_the_techniques_that_compute_all_pixels_at_once() -> None:
    planar = {
        name
        for name, technique in tm.comparisons.TECHNIQUES.items()
        if technique.planar and technique.measures == "moments"
    }

    offered = ReconstructionSettings.model_json_schema()["properties"]["estimator"]["enum"]
    assert set(offered) == planar | set(OF_ANY_MULTIPLES) | {"automatic"}
    assert offered[:4] == ["automatic", "pisarenko", "maximum-entropy", "likelihood"]


@cache
def captured(m: int) -> tuple[AppliedSequence, FrameWithTruth]:
    """A frame of a corner, which indirect light makes continuous."""
    base_frequency_hz = 23e6 if m < 5 else 11.5e6
    with open_camera("sim:corner?noise=off", clock=VirtualClock()) as camera:
        applied = camera.configure(Sequence(harmonics=m, base_frequency_hz=base_frequency_hz))
        (frame,) = capture(camera, 1)
    return applied, frame


@pytest.fixture(autouse=True)
def coarse_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the look-up table be coarse and soon built."""
    monkeypatch.setattr(sra_table, "NODES", 7)


@pytest.mark.parametrize("estimator", get_args(Estimator))
def test_every_estimator_gives_range_and_light_of_captured_frames(estimator: Estimator) -> None:
    settings = ReconstructionSettings(estimator=estimator)
    applied, frame = captured(max(3, settings.least_harmonics))
    recipe = Recipe(applied, settings, 4095.0)

    found = recipe.reconstruct(frame.raw)

    truth_m = frame.truth.range_m
    assert found.range_m.shape == truth_m.shape
    seen = np.isfinite(found.range_m) & np.isfinite(truth_m)
    assert seen.mean() > 0.5
    assert np.median(np.abs(found.range_m - truth_m)[seen]) < 0.5
    total = found.direct + found.indirect + found.uniform
    assert np.allclose(total[seen], found.brightness[seen], rtol=1e-3)


def test_an_estimator_is_chosen_while_frames_flow() -> None:
    with serving("sim:mirrors?noise=off") as served, Camera(served.url, timeout_s=60) as camera:
        camera.sequence = {"harmonics": 4}
        with httpx.Client(base_url=served.url, timeout=60) as http:
            answer = http.put(PATH, json={"estimator": "godbaz"})
        assert answer.status_code == 200
        found = camera.frame("range", after=camera.latest(wait_s=10.0)["frame"], wait_s=10.0)
        truth = camera.frame("truth").array

    assert found.meta["reconstruction_id"] == 2
    error_m = np.abs(found.array - truth)
    # two of the mirrors' three returns: exact where there are no more
    assert np.nanquantile(error_m, 0.2) < 0.05
    assert np.isfinite(error_m).mean() > 0.5


def test_an_estimator_and_too_few_harmonics_do_not_go_together() -> None:
    with (
        serving("sim:mirrors?noise=off") as served,
        httpx.Client(base_url=served.url, timeout=60) as http,
    ):
        http.put("/api/v1/sequence", json={"harmonics": 3}).raise_for_status()

        refused = http.put(PATH, json={"estimator": "spumic"})

        problem = refused.json()
        assert refused.status_code == 409
        assert problem["type"] == "/problems/estimator-misfit"
        assert (problem["field"], problem["value"]) == ("estimator", "spumic")
        assert "needs 6 harmonics" in problem["detail"]
        assert http.get(PATH).json()["reconstruction_id"] == 1

        six = {"harmonics": 6, "base_frequency_hz": 11.5e6}
        http.put("/api/v1/sequence", json=six).raise_for_status()
        http.put(PATH, json={"estimator": "spumic"}).raise_for_status()
        refused = http.put("/api/v1/sequence", json={"harmonics": 4})

        problem = refused.json()
        assert refused.status_code == 409
        assert (problem["field"], problem["value"]) == ("harmonics", 4)
        assert problem["limit"] == "at least 6"
        assert http.get("/api/v1/sequence").json()["harmonics"] == 6


def test_a_daemon_that_starts_with_too_few_harmonics_says_so_with_the_range_alone() -> None:
    with (
        serving("sim:mirrors?noise=off", reconstruction={"estimator": "spumic"}) as served,
        httpx.Client(base_url=served.url, timeout=60) as http,
    ):
        http.get("/api/v1/frames/latest", params={"wait_s": 10})
        problem = http.get("/api/v1/frames/latest/range").json()
        brightness = http.get("/api/v1/frames/latest/brightness")

    assert problem["type"] == "/problems/estimator-misfit"
    assert problem["field"] == "harmonics"
    assert problem["limit"] == "at least 6 for the estimator spumic"
    assert brightness.status_code == 200


def test_computing_time_is_that_of_sequences_which_the_estimator_takes() -> None:
    with open_camera("sim:mirrors", clock=VirtualClock()) as camera:
        seconds = ReconstructionTimer(camera.capabilities, ReconstructionSettings())

        once, often = (seconds(Sequence(harmonics=6, takes=takes), "spumic") for takes in (1, 20))

    assert once is not None
    assert often is not None
    assert 0 < once <= often


def test_the_page_of_estimators_says_what_the_techniques_say() -> None:
    page = (Path(__file__).parents[3] / "docs" / "estimators.md").read_text(encoding="utf-8")

    for technique in tm.comparisons.TECHNIQUES.values():
        assert f"**{technique.name}**, {technique.label}. " in page
        for words in (technique.assumptions, technique.cost, technique.failure):
            assert words in page
    named = [name for name in get_args(Estimator) if name != "automatic"]
    assert [name for name in named if f"| `{name}` |" in page] == named
