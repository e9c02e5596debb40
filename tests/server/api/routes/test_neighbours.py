"""The list of cameras on the network, over HTTP."""

import httpx
import pytest

from tests.server.contract import client_of
from tests.serving import serving
from transientcam_server.api import _neighbours as neighbours


def test_a_service_lists_one_that_announces_itself_and_what_its_camera_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # every request searches, for 1.5 s; how long a result is kept is tested with a clock
    monkeypatch.setattr(neighbours, "FRESH_S", 0.0)
    with (
        serving("sim:wall?noise=off", announce="on") as other,
        serving("sim:wall?noise=off", announce="auto") as asked,
        client_of(asked) as http,
    ):
        capabilities = other.camera.capabilities

        def listed(state: str) -> dict[str, object]:
            """Ask until the announced camera is in this state; the test's time limit ends it."""
            while True:
                document = http.get("/api/v1/cameras").raise_for_status().json()
                assert (document["left_out"], document["reason"]) == (0, None)
                for each in document["cameras"]:
                    if (each["url"], each["state"]) == (other.url, state):
                        return dict(each)

        found = listed("streaming")
        assert (found["model"], found["serial"]) == (capabilities.model, capabilities.serial)

        httpx.put(f"{other.url}/api/v1/acquisition", json={"running": False}).raise_for_status()
        assert listed("stopped")["name"] == found["name"]


def test_without_mdns_the_list_is_empty_and_says_why() -> None:
    with serving("sim:wall", announce="off") as served:
        document = httpx.get(f"{served.url}/api/v1/cameras").raise_for_status().json()

    assert document["cameras"] == []
    assert "`announce` is `off`" in document["reason"]
