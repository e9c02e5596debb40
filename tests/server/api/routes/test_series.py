"""Series, against a script over the same frames: deviation, bias and shares by hand."""

import statistics
import time
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from tests.serving import Served, serving
from tests.waiting import PATIENCE_S, wait_until
from transientcam_driver import AppliedSequence, RawFrame, Sequence
from transientcam_driver.camera import Capabilities
from transientcam_server.camera import measured
from transientcam_server.imaging import Intrinsics, Recipe
from transientcam_server.settings import ReconstructionSettings

FRAMES = 4
BOX = (60, 50, 8, 6)
TARGET_M = 0.01


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving("sim:wall?seed=1") as each:
        each.start_all_workers()
        yield each


def begun(http: httpx.Client, **wanted: Any) -> str:
    answer = http.post("/api/v1/series/jobs", json=wanted)
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def ended(http: httpx.Client, job: str) -> dict[str, Any]:
    end_s = time.monotonic() + PATIENCE_S
    while True:
        found: dict[str, Any] = http.get(f"/api/v1/jobs/{job}", params={"wait_s": 10}).json()
        if found["finished_at"] is not None:
            return found
        assert time.monotonic() < end_s, found


def test_it_agrees_with_a_script_over_the_same_frames(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[AppliedSequence, RawFrame]] = []
    read_frame = served.camera.read_frame

    def kept(*, timeout_s: float) -> RawFrame:
        raw = read_frame(timeout_s=timeout_s)
        seen.append((served.camera.applied, raw))
        return raw

    monkeypatch.setattr(served.camera, "read_frame", kept)
    with httpx.Client(base_url=served.url, timeout=PATIENCE_S) as http:
        before = http.get("/api/v1/sequence").json()
        settings = [
            {"sequence": {"harmonics": m}, "reconstruction": {"neighbours": "none"}} for m in (4, 5)
        ]
        job = begun(http, settings=settings, frames=FRAMES, region=BOX, target_m=TARGET_M)
        result = ended(http, job)["result"]
        wait_until(lambda: http.get("/api/v1/sequence").json()["harmonics"] == before["harmonics"])

    x, y, width, height = BOX
    simulation = served.camera.simulation
    assert simulation is not None
    true_m = simulation.truth().range_m[y : y + height, x : x + width].ravel()
    estimation = ReconstructionSettings(estimator="pisarenko", neighbours="none")
    for row, m in zip(result["rows"], (4, 5), strict=True):
        own = [(applied, raw) for applied, raw in seen if applied.sequence.harmonics == m]
        ranges = [
            Recipe(applied, estimation, 2.0**12 - 1, sensor=served.service.sensor)
            .reconstruct(raw)
            .range_m[y : y + height, x : x + width]
            .ravel()
            for applied, raw in own[:FRAMES]
        ]
        pixels = list(zip(*ranges, strict=True))
        deviations = [statistics.stdev(map(float, each)) for each in pixels]
        biases = [statistics.fmean(map(float, p)) - t for p, t in zip(pixels, true_m, strict=True)]
        off = [abs(v - t) for p, t in zip(pixels, true_m, strict=True) for v in p]

        assert (row["harmonics"], row["frames"], row["pixels"]) == (m, FRAMES, width * height)
        assert (row["reference"], row["valid_share"]) == ("truth", 1.0)
        assert row["range_std_m"] == pytest.approx(statistics.median(deviations), rel=0.01)
        assert row["range_bias_m"] == pytest.approx(statistics.median(biases), rel=0.01)
        assert row["within_share"] == sum(each <= TARGET_M for each in off) / len(off)
        assert row["range_std_m"] > 0


def test_one_that_is_cancelled_gives_the_sequence_back(served: Served) -> None:
    with httpx.Client(base_url=served.url, timeout=PATIENCE_S) as http:
        before = http.get("/api/v1/sequence").json()["harmonics"]
        job = begun(http, settings=[{"sequence": {"harmonics": 6}}], frames=1000, region=BOX)
        wait_until(lambda: http.get(f"/api/v1/jobs/{job}").json()["progress"] > 0)
        assert served.camera.applied.sequence.harmonics == 6
        http.post(f"/api/v1/jobs/{job}/cancel")

        assert ended(http, job)["state"] == "cancelled"
        wait_until(lambda: served.camera.applied.sequence.harmonics == before)
        last = http.get("/api/v1/frames").json()["last"] or 0
        wait_until(lambda: (http.get("/api/v1/frames").json()["last"] or 0) > last)


def test_what_cannot_be_captured_is_refused_by_its_name(served: Served) -> None:
    with httpx.Client(base_url=served.url) as http:
        for wanted, field in (
            ({"settings": [{"sequence": {"harmonics": 99}}]}, "harmonics"),
            ({"settings": [{"sequence": {"exposure_s": 9.0}}]}, "exposure_s"),
            ({"settings": [{}], "region": [0, 0, 9999, 2]}, "region"),
            ({"settings": [{}], "frames": 20_000}, "frames"),
        ):
            problem = http.post("/api/v1/series/jobs", json=wanted).json()
            assert problem["status"] == 422, problem
            assert problem["field"] == field


def test_without_a_truth_ranges_are_held_against_the_plane_that_fits_best() -> None:
    height, width, frames = 12, 16, 5
    lens = Intrinsics.of_field(60.0, width=width, height=height)
    rays = lens.points(np.ones((height, width), np.float32)).astype(float)
    plane_m = 2.0 / np.einsum("i,ihw->hw", np.array([0.1, -0.2, 1.0]), rays)
    noise = 1e-3 * np.array([-1.0, 1.0, 0.0, -1.0, 1.0])[:, None, None]
    found = [((plane_m + each).ravel(), None, _recipe(lens)) for each in noise]

    row = measured(found, np.ones((height, width), bool), 2e-3)

    assert row["reference"] == "plane"
    assert row["range_std_m"] == pytest.approx(1e-3, rel=1e-6)
    assert row["range_bias_abs_m"] < 1e-6
    assert row["within_share"] == 1.0

    bump = np.zeros((height, width), bool)
    bump[3, 4] = True
    raised = [(each + 0.1 * bump.ravel(), None, recipe) for each, _, recipe in found]
    off = measured(raised, np.ones((height, width), bool), 5e-3)
    assert off["within_share"] == pytest.approx(1 - 1 / (height * width))
    assert len(found) == frames


def _recipe(lens: Intrinsics) -> Recipe:
    limits: dict[str, Any] = {"readout_s": 0.0, "streaming_readout_s": 0.0, "max_harmonics": 3}
    limits |= {"tuning_step_hz": 1.0, "min_frequency_hz": 1e6, "max_frequency_hz": 1e8}
    camera: Any = Capabilities(
        model="", serial="", firmware="", protocol_version=0, width=16, height=12, bits=12,
        min_exposure_s=1e-6, max_exposure_s=1.0, **limits,
    )  # fmt: skip
    applied = camera.apply(camera.nearest(Sequence()))
    return Recipe(applied, ReconstructionSettings(), 4095.0, intrinsics=lens)
