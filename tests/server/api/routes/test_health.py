import httpx


def test_a_camera_that_delivers_is_ready(http: httpx.Client) -> None:
    http.get("/api/v1/frames/latest", params={"wait_s": 10.0})

    assert http.get("/readyz").json() == {"status": "ready"}
    assert http.get("/livez").json() == {"status": "alive"}
