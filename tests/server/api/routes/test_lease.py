from typing import Any

import httpx
import pytest

from tests.server.streaming import streaming
from tests.serving import Served
from transientcam.wire import LEASE_HEADER

PATH = "/api/v1/lease"
ANNA: dict[str, Any] = {"holder": "anna", "duration_s": 300.0}


def take(http: httpx.Client, **others: Any) -> dict[str, str]:
    """Take the lease and return the header that shows it."""
    response = http.post(PATH, json=ANNA | others)
    assert response.status_code == 201
    assert response.headers["cache-control"] == "no-store"
    return {LEASE_HEADER: response.json()["lease_id"]}


def test_without_a_lease_any_client_changes_things(http: httpx.Client) -> None:
    assert http.get(PATH).json()["held"] is False
    assert http.put("/api/v1/sequence", json={"harmonics": 4}).status_code == 200


def test_a_lease_shuts_every_other_client_out_of_changes_but_not_of_looking(
    http: httpx.Client,
) -> None:
    mine = take(http)

    for method, path, body in (
        ("PUT", "/api/v1/sequence", {"harmonics": 4}),
        ("PUT", "/api/v1/acquisition", {"running": False}),
        ("POST", "/api/v1/simulation/faults", {"fault": "drop-image"}),
    ):
        refused = http.request(method, path, json=body)
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/lease-held")
        assert refused.json()["holder"] == "anna"
        assert 0.0 < refused.json()["expires_in_s"] <= 300.0
        assert http.request(method, path, json=body, headers=mine).status_code == 200

    assert http.get("/api/v1/sequence").json()["harmonics"] == 4
    assert http.post("/api/v1/sequence/validate", json={}).status_code == 200
    shown = http.get(PATH).json()
    assert (shown["held"], shown["holder"], shown["on_lapse"]) == (True, "anna", "stop")
    assert "lease_id" not in shown


def test_the_lease_is_given_back_by_its_holder_alone(http: httpx.Client) -> None:
    mine = take(http)

    assert http.delete(PATH).status_code == 409
    assert http.delete(PATH, headers={LEASE_HEADER: "guessed"}).status_code == 409
    assert http.delete(PATH, headers=mine).json()["held"] is False
    assert http.put("/api/v1/acquisition", json={"running": True}).status_code == 200
    late = http.put("/api/v1/acquisition", json={"running": True}, headers=mine)
    assert (late.status_code, late.json()["type"]) == (409, "/problems/lease-lost")


def test_renewing_keeps_the_id(http: httpx.Client) -> None:
    mine = take(http)

    plain = http.put(PATH, headers=mine)
    changed = http.put(PATH, headers=mine, json={"duration_s": 60.0, "on_lapse": "keep"})

    assert plain.json()["duration_s"] == 300.0
    assert changed.json()["lease_id"] == mine[LEASE_HEADER]
    assert (changed.json()["duration_s"], changed.json()["on_lapse"]) == (60.0, "keep")
    assert http.put(PATH).json()["type"] == "/problems/lease-lost"


def test_a_lapse_is_reported_and_stops_the_capture_and_the_light(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as watcher:
        watcher.subscribe("flags")
        take(http, duration_s=1.0)
        granted = watcher.notice("lease-changed")
        lapsed = watcher.notice("lease-changed")

    assert granted.details == {"change": "granted", "holder": "anna"}
    assert lapsed.details == {"change": "lapsed", "holder": "anna"}
    camera = http.get("/api/v1/camera").json()
    assert (camera["state"], camera["status"]["light_on"]) == ("stopped", False)
    assert http.put("/api/v1/acquisition", json={"running": True}).status_code == 200


def test_a_lapse_leaves_the_camera_alone_where_that_was_asked_for(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as watcher:
        watcher.subscribe("flags")
        take(http, duration_s=1.0, on_lapse="keep")
        watcher.receive_until(lambda each: getattr(each, "details", {}).get("change") == "lapsed")
        watcher.frame()

    assert http.get("/api/v1/acquisition").json()["running"]


def test_a_takeover_is_reported_to_every_client_and_logged(
    served: Served, http: httpx.Client, caplog: pytest.LogCaptureFixture
) -> None:
    mine = take(http)
    with streaming(served.stream_url) as watcher:
        watcher.subscribe("flags")
        assert http.post(PATH, json={"holder": "bert"}).status_code == 409
        theirs = take(http, holder="bert", takeover=True)
        reported = watcher.notice("lease-changed")

    assert reported.details == {"change": "taken-over", "holder": "bert", "from": "anna"}
    assert "'bert' (anybody) took the lease over from 'anna' (anybody)" in caplog.text
    lost = http.put("/api/v1/acquisition", json={"running": True}, headers=mine).json()
    assert (lost["type"], lost["holder"]) == ("/problems/lease-lost", "bert")
    assert http.delete(PATH, headers=theirs).status_code == 200


def test_the_light_goes_off_without_a_lease(http: httpx.Client) -> None:
    take(http)
    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})

    answer = http.post("/api/v1/acquisition/safe-off")

    assert (answer.status_code, answer.json()["state"]) == (200, "stopped")
    assert not http.get("/api/v1/camera").json()["status"]["light_on"]


def test_after_a_safe_off_the_capture_can_be_started_again(http: httpx.Client) -> None:
    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})
    http.post("/api/v1/acquisition/safe-off")
    frames = http.get("/api/v1/acquisition").json()["frames"]

    assert http.put("/api/v1/acquisition", json={"running": True}).status_code == 200
    again = http.get("/api/v1/frames/latest", params={"wait_s": 10.0, "after": frames})
    assert again.status_code == 200


def test_a_lost_camera_that_was_switched_off_is_not_started_when_it_is_back(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as watcher:
        watcher.subscribe("flags")
        http.post("/api/v1/simulation/faults", json={"fault": "unplug"})
        watcher.notice("camera-lost")
        answer = http.post("/api/v1/acquisition/safe-off")
        assert (answer.status_code, answer.json()["type"]) == (503, "/problems/camera-lost")
        http.post("/api/v1/simulation/faults", json={"fault": "replug"})
        watcher.notice("camera-back")

    camera = http.get("/api/v1/camera").json()
    assert (camera["state"], camera["status"]["light_on"]) == ("stopped", False)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"holder": ""}, "holder"),
        ({"holder": "   "}, "holder"),
        ({"holder": "a\nb"}, "holder"),
        ({"holder": "x" * 81}, "holder"),
        ({"holder": 5}, "holder"),
        ({"duration_s": 0.5}, "duration_s"),
        ({"duration_s": 1e9}, "duration_s"),
        ({"on_lapse": "burn"}, "on_lapse"),
        ({"takeover": "yes"}, "takeover"),
        ({"force": True}, "force"),
    ],
)
def test_terms_that_cannot_be_are_refused_by_name(
    steady: httpx.Client, change: dict[str, Any], field: str
) -> None:
    response = steady.post(PATH, json=ANNA | change)

    assert (response.status_code, response.json()["field"]) == (422, field)
    assert steady.get(PATH).json()["held"] is False
