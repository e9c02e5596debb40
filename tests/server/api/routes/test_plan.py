"""Planning over REST: recommendations, refusals, and the front of the scene that is seen."""

import io
import json
from collections.abc import Iterator
from http.client import HTTPConnection
from importlib import import_module
from typing import Any
from unittest import mock
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from tests.server.contract import client_of
from tests.server.planning.calls import Endless, Here
from tests.serving import Served, serving
from transientcam import Camera
from transientcam.wire import LEASE_HEADER
from transientcam_server.errors import JobCancelled, Problem

FIXED = {"base_frequency_hz": 23e6, "harmonics": 3}
SCENE = {"brightness_dn_per_s": 8e5, "returns": [{"range_m": 1.5}, {"range_m": 3.0, "weight": 0.5}]}


@pytest.fixture(scope="module")
def noisy_daemon() -> Iterator[Served]:
    with serving("sim:mirrors?seed=2") as daemon:
        daemon.start_all_workers()
        # its own process has the lowest priority, and waits for all that a laden machine does
        with mock.patch.object(daemon.service.planning, "_process", Here()):
            yield daemon


@pytest.fixture(scope="module")
def noisy(noisy_daemon: Served) -> Iterator[httpx.Client]:
    with client_of(noisy_daemon) as client:
        client.get("/api/v1/frames/latest", params={"wait_s": 10.0})
        yield client


def ask(client: httpx.Client, **request: Any) -> httpx.Response:
    """Ask for a plan with one estimator: the search over all of them is the planner's test."""
    usual = {"fixed": FIXED, "estimator": "pisarenko"}
    return client.post("/api/v1/plan", json=usual | request)


def test_a_plan_for_the_scene_before_the_camera_is_a_sequence_it_takes(noisy: httpx.Client) -> None:
    answer = ask(noisy, target={"range_error_m": 0.02}).json()

    predicted = answer["predicted"]
    assert predicted["range_error_m"]["median"] <= 0.02
    assert predicted["range_std_m"]["median"] > 0
    assert predicted["range_bias_m"] < predicted["range_error_m"]["p90"]
    within = predicted["within"]
    assert (within["share"], within["target_m"]) == (0.9, 0.02)
    assert within["error_m"] <= 0.02
    assert 0.9 <= within["target_share"] <= 1
    beyond = list(predicted["beyond"].values())
    assert beyond == sorted(beyond, reverse=True)
    items = answer["price"]
    spent_s = sum(items[f"{name}_s"] for name in ("light", "readout", "settling"))
    assert spent_s == pytest.approx(answer["capture_s"])
    waited_s = items["transport_s"] + (items["computing_s"] or 0.0)
    assert items["sum_s"] == pytest.approx(spent_s + waited_s)
    assert {each["what"] for each in answer["changes"]} == {"readout", "light"}
    assert "mm noise, " in answer["summary"]
    assert answer["scene"]["ambiguity_checked"] is True
    assert answer["scene"]["lit_share"] > 0.9
    assert answer["sequence"]["harmonics"] == 3
    checked = noisy.post("/api/v1/sequence/validate", json=answer["sequence"]).json()
    assert checked["capture_s"] == pytest.approx(answer["capture_s"])
    assert answer["twice_accuracy"]["time_factor"] > 1


def test_a_camera_without_a_twin_looks_by_itself_and_frames_go_on(
    noisy_daemon: Served, noisy: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a camera that is not simulated: of one frame no target is out of reach."""
    monkeypatch.setattr(noisy_daemon.service.looks, "_twin", None)
    before = noisy.get("/api/v1/sequence").json()

    of_frame, of_look = (ask(noisy, target={"range_error_m": 1e-5}, look=x) for x in (False, True))

    assert [each.json()["decided"] for each in (of_frame, of_look)] == [False, True]
    latest = noisy.get("/api/v1/frames/latest", params={"wait_s": 10.0}).json()
    after = latest["frame"]
    newer = noisy.get("/api/v1/frames/latest", params={"after": after, "wait_s": 10.0}).json()
    assert newer["frame"] > after
    restored = noisy.get("/api/v1/sequence").json()
    assert restored == before | {"sequence_id": restored["sequence_id"]}
    with Camera(noisy_daemon.url) as other, other.lease("another client"):
        refused = ask(noisy, target={"range_error_m": 0.02}, look=True)
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/lease-held")


def test_a_given_scene_needs_no_frame(noisy: httpx.Client) -> None:
    answer = ask(noisy, budget={"capture_s": 0.2}, scene=SCENE).json()

    assert answer["capture_s"] <= 0.2
    assert answer["reconstruct_s"] > 0
    assert answer["computing_share"] == pytest.approx(
        answer["reconstruct_s"] * answer["frame_rate_hz"]
    )


def test_ambient_light_costs_accuracy(noisy: httpx.Client) -> None:
    dark, lit = (
        ask(noisy, budget={"capture_s": 0.1}, scene=SCENE | {"ambient_dn_per_s": ambient}).json()
        for ambient in (0.0, 2e6)
    )

    errors = [each["predicted"]["range_std_m"]["median"] for each in (dark, lit)]
    assert errors[1] > 1.3 * errors[0]


def test_an_impossible_target_is_refused_with_the_best_achievable(noisy: httpx.Client) -> None:
    response = ask(noisy, target={"range_error_m": 1e-7}, scene=SCENE)

    problem = response.json()
    assert response.status_code == 409
    assert problem["type"] == "/problems/target-unreachable"
    assert problem["field"] == "range_error_m"
    assert problem["limited_by"] in ("noise", "bias")
    assert problem["limit"] > 1e-7
    assert noisy.post("/api/v1/sequence/validate", json=problem["best"]["sequence"]).is_success


@pytest.mark.parametrize(
    ("request_body", "field"),
    [
        ({}, "target"),
        ({"target": {"range_error_m": -1}}, "target.range_error_m"),
        ({"estimator": "guess", "budget": {"capture_s": 1}}, "estimator"),
        ({"target": {"range": 1}}, "target.range"),
        ({"budget": {"frame_rate_hz": "fast"}}, "budget.frame_rate_hz"),
        ({"fixed": {"harmonics": 99}, "budget": {"capture_s": 1}}, "harmonics"),
        ({"scene": {"brightness_dn_per_s": 0}, "budget": {"capture_s": 1}}, None),
        ({"share": 1.0, "budget": {"capture_s": 1}}, "share"),
        ({"region": [150, 0, 20, 20], "budget": {"capture_s": 1}}, "region"),
        ({"region": [[0, 0], [9, 9]], "budget": {"capture_s": 1}}, "region"),
    ],
)
def test_a_request_that_cannot_be_meant_is_refused_by_name(
    noisy: httpx.Client, request_body: dict[str, Any], field: str | None
) -> None:
    response = noisy.post("/api/v1/plan", json=request_body)

    assert response.status_code == 422
    if field is not None:
        assert response.json()["field"] == field


def test_the_front_falls_and_the_current_frame_says_where_it_stands(
    noisy: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    families = import_module("transientcam_server.planning._search.families")  # not the function
    monkeypatch.setattr(families, "HARMONICS", (3,))
    monkeypatch.setattr(families, "SEARCHED", ("maximum-entropy",))

    job = end_of(noisy, noisy.post("/api/v1/tradeoff/jobs", json={}).json())
    assert (job["kind"], job["state"], job["problem"]) == ("tradeoff", "done", None)
    answer = job["result"]
    assert set(noisy.get("/api/v1/tradeoff").json()) == set(answer)

    times_s = [each["capture_s"] for each in answer["front"]]
    errors_m = [each["predicted"]["range_error_m"]["median"] for each in answer["front"]]
    assert len(times_s) > 3
    assert times_s == sorted(times_s)
    assert errors_m == sorted(errors_m, reverse=True)
    assert {(each["harmonics"], each["estimator"]) for each in answer["lines"]} == {
        (each["sequence"]["harmonics"], each["estimator"]) for each in answer["front"]
    }
    for line in answer["lines"]:
        noise_m = [point["range_std_m"] for point in line["points"]]
        assert noise_m == sorted(noise_m, reverse=True)
        assert all(point["range_error_m"] > 0 for point in line["points"])
    assert answer["summary"].endswith(".")
    current = answer["current"]
    assert 0 < current["range_error_m"]["median"] < 0.05
    # noise is most of what the median pixel is off by
    assert current["meta"]["predicted_range_std_m"]["median"] == pytest.approx(
        current["range_error_m"]["median"] / 0.6745, rel=0.5
    )
    accuracy = current["meta"]["accuracy"]
    assert 0 < accuracy["range_bias_m"] <= accuracy["range_error_m"] < 0.5
    assert 0.5 < accuracy["trusted_share"] <= 1


@pytest.fixture(params=["plan", "tradeoff"])
def endless(
    request: pytest.FixtureRequest, noisy_daemon: Served, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[str, Endless]]:
    """What a plan or a front is computed by, and which; no scene is looked at for it."""
    planner, work = noisy_daemon.service.planner, Endless()
    monkeypatch.setattr(planner, f"{request.param}_document", work)
    monkeypatch.setattr(planner, "look", lambda *_, **__: None)
    noisy_daemon.service.fronts.forget()
    yield request.param, work
    work.ended.set()
    noisy_daemon.service.fronts.forget()


def test_a_client_that_leaves_ends_the_work(
    noisy: httpx.Client, noisy_daemon: Served, endless: tuple[str, Endless]
) -> None:
    what, work = endless
    client = HTTPConnection(urlsplit(noisy_daemon.url).netloc)
    if what == "plan":
        body = json.dumps({"target": {"range_error_m": 0.01}})
        client.request("POST", "/api/v1/plan", body, {"content-type": "application/json"})
    else:
        client.request("GET", "/api/v1/tradeoff")
    assert work.began.wait(60)

    client.close()

    assert work.ended.wait(60)
    assert isinstance(work.raised, Problem)


def start(client: httpx.Client, **request: Any) -> dict[str, Any]:
    response = client.post("/api/v1/plan/jobs", json={"fixed": FIXED, "scene": SCENE, **request})
    job: dict[str, Any] = response.json()
    assert response.status_code == 202
    assert response.headers["location"] == f"../jobs/{job['id']}"
    return job


def end_of(client: httpx.Client, job: dict[str, Any]) -> dict[str, Any]:
    while job["finished_at"] is None:
        job = client.get(f"/api/v1/jobs/{job['id']}", params={"wait_s": 30}).json()
    return job


def test_a_job_makes_the_plan_that_a_request_waits_for(noisy: httpx.Client) -> None:
    goal = {"budget": {"capture_s": 0.2}, "estimator": "maximum-entropy"}
    expected = ask(noisy, scene=SCENE, **goal).json()

    job = end_of(noisy, start(noisy, **goal))

    assert (job["kind"], job["state"], job["progress"]) == ("plan", "done", 1.0)
    for name in ("sequence", "predicted", "summary", "scene"):
        assert job["result"][name] == expected[name]


def test_a_job_maps_the_error_of_each_pixel_and_says_who_is_within_a_region(
    noisy: httpx.Client,
) -> None:
    goal = {"budget": {"capture_s": 0.2}, "estimator": "single-frequency", "map": True}
    fixed = {"base_frequency_hz": 23e6, "harmonics": 1, "exposure_s": 5e-4, "takes": 1}

    region = [40, 30, 60, 50]
    job = end_of(noisy, start(noisy, **goal, fixed=fixed, scene=None, region=region))

    assert job["state"] == "done", job["problem"]
    assert job["result"]["region"] == [[40, 30], [99, 30], [99, 79], [40, 79]]
    path = f"/api/v1/jobs/{job['id']}/map"
    error_m = np.load(io.BytesIO(noisy.get(f"{path}.npy").content))
    assert error_m.shape == (120, 163)
    stated = job["result"]["predicted"]["range_error_m"]
    inside = error_m[30:80, 40:100]
    assert np.nanmedian(inside) == pytest.approx(stated["median"], rel=0.15)
    assert noisy.get(f"{path}.png").content.startswith(b"\x89PNG")
    without = noisy.get(f"/api/v1/jobs/{end_of(noisy, start(noisy, **goal))['id']}/map.npy")
    assert (without.status_code, without.json()["type"]) == (404, "/problems/not-found")


def test_a_job_fails_with_what_the_request_is_refused_with(noisy: httpx.Client) -> None:
    impossible = {"target": {"range_error_m": 1e-7}, "estimator": "single-frequency"}

    job = end_of(noisy, start(noisy, **impossible))

    assert job["state"] == "failed"
    assert job["problem"]["type"] == "/problems/target-unreachable"
    assert job["problem"]["field"] == "range_error_m"


def test_what_is_planned_is_cancelled_without_the_lease_and_reports_its_steps(
    noisy: httpx.Client, endless: tuple[str, Endless]
) -> None:
    what, work = endless
    lease = noisy.post("/api/v1/lease", json={"holder": "test", "duration_s": 60}).json()
    try:
        body = {"target": {"range_error_m": 0.01}} if what == "plan" else {}
        job = noisy.post(f"/api/v1/{what}/jobs", json=body).json()
        assert work.began.wait(60)
        running = noisy.get(f"/api/v1/jobs/{job['id']}").json()

        noisy.post(f"/api/v1/jobs/{job['id']}/cancel")

        assert work.ended.wait(60)
        assert isinstance(work.raised, JobCancelled)
        assert running["kind"] == what
        assert (running["state"], running["step"]) == ("running", "searching")
        assert 0.5 < running["progress"] < 1
        assert running["result"]["summary"] == "One of many."
        if what == "tradeoff":
            assert running["result"]["current"]["capture_s"] > 0
        ended = end_of(noisy, job)
        assert (ended["state"], ended["result"]) == ("cancelled", running["result"])
    finally:
        noisy.delete("/api/v1/lease", headers={LEASE_HEADER: lease["lease_id"]})


def test_a_viewer_has_new_frames_while_something_is_planned(
    noisy: httpx.Client, noisy_daemon: Served, endless: tuple[str, Endless]
) -> None:
    what, work = endless
    body = {"target": {"range_error_m": 0.01}} if what == "plan" else {}
    with Camera(noisy_daemon.url, timeout_s=60.0) as camera, camera.stream("range") as stream:
        frames = iter(stream)
        numbers = [next(frames).meta["frame"]]
        job = noisy.post(f"/api/v1/{what}/jobs", json=body).json()
        assert work.began.wait(60)

        numbers += [next(frames).meta["frame"] for _ in range(4)]

        assert not work.ended.is_set()
        noisy.post(f"/api/v1/jobs/{job['id']}/cancel")
        assert end_of(noisy, job)["state"] == "cancelled"
    assert numbers == sorted(set(numbers))


def test_errors_of_the_range_cost_nothing_until_a_client_requests_them(noisy: httpx.Client) -> None:
    noisy.put("/api/v1/acquisition", json={"running": False})
    try:
        before, asked, after = (
            json.loads(noisy.get(f"/api/v1/frames/latest/{name}.npy").headers["transientcam-meta"])
            for name in ("range", "range_error", "range")
        )
    finally:
        noisy.put("/api/v1/acquisition", json={"running": True})

    assert before["frame"] == asked["frame"] == after["frame"]
    assert before["accuracy"] is None
    errors = asked["accuracy"]
    assert errors["range_std_m"] < errors["range_error_m"] < 0.5
    assert 0.5 < errors["trusted_share"] <= 1
    assert errors["range_error_m"] <= errors["within_m"] < 1.0
    assert sum(errors["trust"].values()) == 163 * 120
    assert after["accuracy"] == errors


def test_a_frames_metadata_predict_its_range(noisy: httpx.Client) -> None:
    meta = noisy.get("/api/v1/frames/latest/range.npy").headers["transientcam-meta"]

    assert '"predicted_range_std_m":{"median":0.0' in meta
