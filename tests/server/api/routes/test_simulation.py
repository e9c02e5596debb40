import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

import transientcam
from tests.serving import Served
from transientcam import wire
from transientcam_driver import open_camera
from transientcam_server.camera import snapshot_of
from transientcam_server.errors import Problem


def test_the_simulated_scene_is_reported(http: httpx.Client) -> None:
    document = http.get("/api/v1/simulation").json()

    assert document["scene"] == "mirrors"
    assert document["effects"] == {}
    assert document["plugged"]
    assert {"corner", "wall", "visitor"} <= {each["name"] for each in document["scenes"]}
    assert "measured" not in {each["name"] for each in document["scenes"]}
    assert set(document["faults"]) == {"unplug", "replug", "corrupt-image", "drop-image"}


def test_what_the_scene_calls_for_is_explained(http: httpx.Client) -> None:
    document = http.get("/api/v1/simulation/explain").json()

    assert (document["scene"], document["device"]) == ("mirrors", "ideal")
    assert document["sequence"]["harmonics"] == http.get("/api/v1/sequence").json()["harmonics"]
    effects = {each["effect"]: each for each in document["effects"]}
    assert effects["mirror-paths"]["built"]
    assert effects["mirror-paths"]["relative"] > document["called_above"]
    assert not effects["motion"]["called_for"]
    assert effects["motion"]["reason"] == "nothing moves"


@pytest.mark.parametrize(
    "body", [{}, {"fault": "explode"}, {"fault": 3}, {"fault": "unplug", "a": 1}]
)
def test_an_unknown_fault_is_refused(http: httpx.Client, body: object) -> None:
    assert http.post("/api/v1/simulation/faults", json=body).status_code == 422


def test_a_real_camera_has_no_simulation_no_faults_and_no_truth(
    served: Served, http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(served.camera, "simulation", None)
    served.service.pipeline.products.pop("truth")

    for response in (
        http.get("/api/v1/simulation"),
        http.get("/api/v1/simulation/explain"),
        http.post("/api/v1/simulation/faults", json={"fault": "unplug"}),
        http.put("/api/v1/simulation", json={"scene": "wall"}),
    ):
        assert response.json()["type"] == "/problems/not-simulated"
    problem = http.get("/api/v1/frames/latest/truth").json()
    assert problem["type"] == "/problems/unknown-product"
    assert problem["known"] == sorted(set(wire.PRODUCTS) - {"truth"})


def test_the_camera_is_put_before_another_scene_while_it_captures(
    served: Served, http: httpx.Client
) -> None:
    with transientcam.Camera(served.url) as camera, open_camera("sim:wall?noise=off") as wall:
        first = camera.frame("range", wait_s=10.0).frame
        assert camera.simulate("wall", effects={"ambient": "on"})["scene"] == "wall"
        try:
            both = camera.frame("range", after=camera.frame("range").frame, wait_s=10)
            seen = camera.frame("range", after=both.frame, wait_s=10)
            assert wall.simulation is not None
            true_m = wall.simulation.truth().range_m

            assert seen.frame > first
            np.testing.assert_allclose(camera.frame("truth").array, true_m, atol=1e-6)
            np.testing.assert_allclose(seen.array, true_m, atol=0.05)
            explained = http.get("/api/v1/simulation/explain").json()
            effects = {each["effect"]: each for each in explained["effects"]}
            assert (explained["scene"], effects["ambient"]["choice"]) == ("wall", "on")
        finally:
            assert camera.simulate("mirrors", effects={})["effects"] == {}


OWN = """
name = "a wall of my own"
[light]
position_m = [0, 0, 0]
aim_at_m = [0, 1, 0]
electrons_per_s = 1e8
[[surface]]
kind = "diffuse"
centre_m = [0, 1.5, 0]
normal = [0, -1, 0]
size_m = [4, 4]
albedo = 0.5
"""


def test_the_camera_is_put_before_a_scene_that_the_client_sends(
    served: Served, http: httpx.Client
) -> None:
    with transientcam.Camera(served.url) as camera:
        sent = http.put("/api/v1/simulation", json={"definition": OWN}).raise_for_status()
        try:
            assert sent.json()["scene"] == "a wall of my own"
            # it stays while something else is chosen of it
            http.put("/api/v1/simulation", json={"effects": {"ambient": "on"}}).raise_for_status()
            again = http.put("/api/v1/simulation", json={"scene": "a wall of my own"})
            assert again.raise_for_status().json()["effects"] == {"ambient": "on"}
            truth_m = camera.frame("truth", after=camera.frame("truth").frame, wait_s=10).array
            assert truth_m[60, 81] == pytest.approx(1.5, abs=1e-3)
            assert snapshot_of(served.camera, "sim:mirrors?noise=off").definition == OWN
        finally:
            back = http.put("/api/v1/simulation", json={"scene": "mirrors", "effects": {}})
            assert back.raise_for_status().json()["scene"] == "mirrors"
    assert snapshot_of(served.camera, "sim:mirrors?noise=off").definition is None


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"definition": "seed ="}, "the text"),
        ({"definition": OWN.replace("0.5", "2")}, "surface[0].albedo"),
        ({"definition": OWN.replace("0.5", "0x" + "f" * 5000)}, "surface[0].albedo"),
        ({"definition": OWN.replace("0.5", "2020-02-02")}, "surface[0].albedo"),
        ({"definition": OWN.replace("a wall of my own", "wall")}, "name"),
        ({"definition": OWN + "[device]\nwaveform_file = '/dev/zero'"}, "device.waveform_file"),
        ({"definition": OWN, "scene": "wall"}, "scene"),
        ({"definition": "#" * 65_537}, "definition"),
    ],
)
def test_a_scene_that_is_not_valid_is_refused_and_the_scene_stays(
    http: httpx.Client, body: object, field: str
) -> None:
    refused = http.put("/api/v1/simulation", json=body)

    problem = refused.json()
    assert (refused.status_code, problem["type"]) == (422, "/problems/invalid-request")
    assert problem["field"].removeprefix("body.") == field
    assert problem["limit"]
    assert http.get("/api/v1/simulation").json()["scene"] == "mirrors"


@pytest.mark.parametrize(
    ("body", "field", "value"),
    [
        ({"scene": "moon"}, "scene", "moon"),
        ({"scene": "measured"}, "scene", "measured"),
        ({"scene": "/etc/passwd.toml"}, "scene", "/etc/passwd.toml"),
        ({"effects": {"rain": "on"}}, "effects", "rain"),
    ],
)
def test_what_cannot_be_simulated_is_refused_by_name_and_the_scene_stays(
    http: httpx.Client, body: object, field: str, value: str
) -> None:
    refused = http.put("/api/v1/simulation", json=body)

    problem = refused.json()
    assert (refused.status_code, problem["type"]) == (422, "/problems/invalid-request")
    assert (problem["field"], problem["value"]) == (field, value)
    assert "wall" in problem["limit"] or "ambient" in problem["limit"]
    assert http.get("/api/v1/simulation").json()["scene"] == "mirrors"


def test_streams_are_notified_of_another_scene(served: Served) -> None:
    notices: list[wire.Notice] = []
    with transientcam.Camera(served.url) as camera:
        with camera.stream("range", on_notice=notices.append) as stream:
            frames = iter(stream)
            next(frames)
            camera.simulate(effects={"lens-scatter": "off"})
            # others may come first: a laden machine drops frames
            while "simulation-changed" not in [each.kind for each in notices]:
                next(frames)
        camera.simulate(effects={})

    (changed,) = (each for each in notices if each.kind == "simulation-changed")
    assert changed.details == {
        "scene": "mirrors",
        "effects": {"lens-scatter": "off"},
        "diffusor": False,
    }


class Preparing:
    """Prepares a scene until it is asked to give up, in the place of `Simulation.change`."""

    def __init__(self) -> None:
        self.begun, self.given_up = threading.Event(), threading.Event()

    def __call__(self, *, ask: Callable[[], object], **_: object) -> None:
        self.begun.set()
        try:
            while not self.given_up.wait(0.01):
                ask()
        except Problem:
            self.given_up.set()
            raise


def test_a_scene_that_is_prepared_is_given_up_when_its_client_leaves(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    preparing = Preparing()
    monkeypatch.setattr(served.camera.simulation, "change", preparing)
    address = urlsplit(served.url)
    body = b'{"scene": "wall"}'
    head = (
        f"PUT /api/v1/simulation HTTP/1.1\r\nHost: {address.netloc}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    with socket.create_connection((address.hostname, address.port)) as client:
        client.sendall(head.encode() + body)
        assert preparing.begun.wait(60.0)
        assert not preparing.given_up.is_set()
    assert preparing.given_up.wait(60.0)


def test_a_scene_that_is_prepared_is_given_up_when_the_service_ends(
    served: Served, http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    preparing = Preparing()
    monkeypatch.setattr(served.camera.simulation, "change", preparing)
    with ThreadPoolExecutor(1) as other:
        answer = other.submit(http.put, "/api/v1/simulation", json={"scene": "wall"}, timeout=60.0)
        assert preparing.begun.wait(60.0)
        served.service.closing.set()
        try:
            assert answer.result(60.0).json()["type"] == "/problems/shutting-down"
        finally:
            served.service.closing.clear()


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("[0, 2, 0]", "[0, 1e308, 0]", "light.aim_at_m"),
        ("patches = 2", "patches = 45", "transport.patches"),
    ],
)
def test_a_scene_that_costs_too_much_or_has_no_numbers_names_key_and_limit(
    http: httpx.Client, old: str, new: str, field: str
) -> None:
    sphere = """
[[surface]]
kind = "diffuse"
shape = "sphere"
centre_m = [{}, 3, 0]
radius_m = 1
albedo = 0.9
"""
    scene = """
[light]
electrons_per_s = 6e6
position_m = [0.1, 0, 0]
aim_at_m = [0, 2, 0]
[camera]
[transport]
patches = 2
""" + "".join(sphere.format(x) for x in (-1.2, 1.2))
    refused = http.put("/api/v1/simulation", json={"definition": scene.replace(old, new)})

    assert refused.status_code == 422
    assert refused.json()["field"] == field
    assert refused.json()["limit"]
