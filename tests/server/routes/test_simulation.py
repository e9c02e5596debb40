import httpx
import pytest

from tests.serving import Served
from transientcam import wire


def test_the_simulated_scene_is_told(http: httpx.Client) -> None:
    document = http.get("/api/v1/simulation").json()

    assert document["scene"] == "mirrors"
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
    served: Served, http: httpx.Client
) -> None:
    served.camera.simulation = None
    served.service.pipeline.products.pop("truth")

    for response in (
        http.get("/api/v1/simulation"),
        http.get("/api/v1/simulation/explain"),
        http.post("/api/v1/simulation/faults", json={"fault": "unplug"}),
    ):
        assert response.json()["type"] == "/problems/not-simulated"
    problem = http.get("/api/v1/frames/latest/truth").json()
    assert problem["type"] == "/problems/unknown-product"
    assert problem["known"] == sorted(set(wire.PRODUCTS) - {"truth"})
