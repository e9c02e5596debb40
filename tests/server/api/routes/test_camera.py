import httpx

from tests.serving import Served
from tests.waiting import wait_until


def test_the_camera_is_reported_with_capabilities_status_and_counters(
    served: Served, http: httpx.Client
) -> None:
    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})

    document = http.get("/api/v1/camera").json()

    assert document["state"] == "streaming"
    assert document["simulated"]
    assert document["capabilities"]["serial"] == served.camera.capabilities.serial
    assert document["capabilities"]["width"] == 163
    assert document["status"]["state"] == "streaming"
    assert document["status"]["light_on"]
    assert document["counters"]["images"] >= 16
    # a laden machine loses some
    assert 0 <= document["counters"]["lost"] <= served.camera.counters.lost


def test_a_lost_camera_is_reported_as_lost_with_the_reason(
    served: Served, http: httpx.Client
) -> None:
    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})
    served.service.acquisition.submit(lambda: None).result()
    assert served.camera.simulation is not None
    served.camera.simulation.unplug()
    wait_until(lambda: served.service.acquisition.status().state == "lost")

    document = http.get("/api/v1/camera").json()

    assert document["state"] == "lost"
    assert document["reason"]
    assert document["status"] is None
    assert document["capabilities"]["width"] == 163
