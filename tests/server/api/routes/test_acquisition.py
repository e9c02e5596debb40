import httpx
import pytest

from tests.serving import Served

PATH = "/api/v1/acquisition"


def test_the_acquisition_reports_its_measured_rate(served: Served, http: httpx.Client) -> None:
    for after in (0, 1, 2):
        http.get("/api/v1/frames/latest", params={"wait_s": 10.0, "after": after})

    document = http.get(PATH).json()

    assert document["running"]
    assert document["state"] == "streaming"
    assert document["frames"] >= 3
    assert document["rate_hz"] is not None
    assert not document["stalled"]


def test_stopping_turns_the_light_off_and_starting_lets_frames_flow_again(
    served: Served, http: httpx.Client
) -> None:
    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})

    stopped = http.put(PATH, json={"running": False}).json()

    assert (stopped["running"], stopped["state"]) == (False, "stopped")
    assert not http.get("/api/v1/camera").json()["status"]["light_on"]
    frames = http.get(PATH).json()["frames"]
    assert http.get("/readyz").status_code == 200
    assert http.get(PATH).json()["frames"] == frames

    started = http.put(PATH, json={"running": True}).json()

    assert started["running"]
    response = http.get("/api/v1/frames/latest", params={"wait_s": 10.0, "after": frames})
    assert response.status_code == 200


def test_stopping_twice_is_no_error(http: httpx.Client) -> None:
    for _ in range(2):
        assert http.put(PATH, json={"running": False}).status_code == 200


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "running"),
        ({"running": "yes"}, "running"),
        ({"running": None}, "running"),
        ({"running": 1}, "running"),
        ({"running": True, "speed": 3}, "speed"),
        ([], "body"),
    ],
)
def test_a_wish_that_is_not_clear_is_refused(http: httpx.Client, body: object, field: str) -> None:
    response = http.put(PATH, json=body)

    assert response.status_code == 422
    assert response.json()["field"] == field
