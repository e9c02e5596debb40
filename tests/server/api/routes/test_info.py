import httpx
import pytest

import transientcam_moments as tm
from transientcam import wire


def test_the_service_says_what_it_is_and_what_its_frames_have(http: httpx.Client) -> None:
    http.put("/api/v1/acquisition", json={"running": False})
    info = http.get("/api/v1/info").json()

    assert info["name"] == "transientcam"
    assert info["api"] == "v1"
    assert info["stream"] == {
        "path": "/api/v1/stream",
        "subprotocol": wire.SUBPROTOCOL,
        "asyncapi": "/asyncapi.json",
        "encodings": list(wire.encoding_names()),
    }
    assert info["caller"] == {"name": "anybody", "role": "admin", "may_light": True}
    products = {product["name"]: product for product in info["products"]}
    assert set(products) == set(wire.PRODUCTS)
    images = ["msgpack", "npy", "npz", "png", "tiff", "csv"]
    assert products["range"]["formats"] == images
    assert products["moments"]["formats"] == ["msgpack", "npy", "npz"]
    assert products["pointcloud"]["formats"] == ["msgpack", "npy", "npz", "tiff", "ply"]
    assert info["history"] == http.get("/api/v1/frames").json()
    assert products["transient"]["over_time"]
    assert not products["transient"]["streamed"]


def test_the_versions_of_the_interface_are_reported_at_a_path_without_version(
    http: httpx.Client,
) -> None:
    versions = http.get("/api/versions").json()

    assert versions["api"] == [{"name": "v1", "path": "/api/v1"}]


def test_the_device_that_computes_is_stated_with_what_it_was_asked_for(
    http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert http.get("/api/v1/info").json()["device"] is None
    assert "transientcam_device_results" not in http.get("/metrics").text
    state = {
        "wanted": "gpu",
        "name": "Big GPU",
        "results": {"device": 41, "processor": 2},
        "refused": "it failed",
    }
    monkeypatch.setattr(tm.kernels, "device_state", lambda: state)

    assert http.get("/api/v1/info").json()["device"] == state
    assert 'device_results_total{device="processor"} 2.0' in http.get("/metrics").text
