"""The settings of the reconstruction are changed while frames flow."""

import httpx
import pytest

from tests.serving import Served
from transientcam import Camera, Notice

PATH = "/api/v1/reconstruction"


def meta_of_next_frame(http: httpx.Client) -> dict[str, object]:
    last = http.get("/api/v1/frames/latest", params={"wait_s": 10}).json()["frame"]
    query = {"wait_s": 10, "after": last}
    meta: dict[str, object] = http.get("/api/v1/frames/latest", params=query).json()
    return meta


def test_frames_from_the_next_one_on_are_computed_with_other_settings(http: httpx.Client) -> None:
    before = http.get(PATH).json()
    assert before["reconstruction_id"] == 1

    after = http.put(PATH, json={"estimator": "single-frequency", "smoothing_px": 0}).json()

    assert after["reconstruction_id"] == 2
    assert after["smoothing_px"] == 0.0
    assert after["bias"] == before["bias"]
    assert http.get(PATH).json() == after
    assert http.get("/api/v1/info").json()["reconstruction"]["estimator"] == "single-frequency"
    assert meta_of_next_frame(http)["reconstruction_id"] == 2


def test_the_estimator_decides_about_the_range(served: Served) -> None:
    """Over the mirrors, the single frequency mixes returns that Pisarenko's method separates."""
    with Camera(served.url, timeout_s=60) as camera:
        truth = camera.frame("truth", wait_s=10.0).array
        separated = camera.frame("range").array
        with httpx.Client(base_url=served.url, timeout=60) as http:
            http.put(PATH, json={"estimator": "single-frequency"})
        now = camera.latest()["frame"]
        mixed = camera.frame("range", after=now, wait_s=10.0)

    assert mixed.meta["reconstruction_id"] == 2
    error_m = [abs(each - truth) for each in (separated, mixed.array)]
    seen = ~(error_m[0] != error_m[0]) & ~(error_m[1] != error_m[1])
    assert error_m[1][seen].mean() > 3 * error_m[0][seen].mean()


def test_the_same_settings_again_are_no_change(http: httpx.Client) -> None:
    document = http.get(PATH).json()
    tag = http.get(PATH).headers["etag"]

    answer = http.put(PATH, json=document)

    assert answer.json() == document
    assert answer.headers["etag"] == tag
    assert http.get(PATH, headers={"If-None-Match": tag}).status_code == 304


def test_only_what_one_has_read_is_changed(http: httpx.Client) -> None:
    tag = http.get(PATH).headers["etag"]
    http.put(PATH, json={"bias": 0.01, "estimator": "pisarenko"})

    late = http.put(PATH, json={"bias": 0.02}, headers={"If-Match": tag})

    assert late.status_code == 412
    assert late.json()["type"] == "/problems/reconstruction-changed"
    assert http.get(PATH).json()["bias"] == 0.01
    assert late.json()["current"] == http.get(PATH).headers["etag"]


@pytest.mark.parametrize(
    ("settings", "field", "limit"),
    [
        ({"bias": 1.0}, "bias", "at most 0.99"),
        ({"bias": "0.1"}, "bias", "a valid number"),
        ({"smoothing_px": -1}, "smoothing_px", "at least 0"),
        ({"estimator": "guess"}, "estimator", "'pisarenko', 'maximum-entropy'"),
        ({"precision": "half"}, "precision", "left out"),
    ],
)
def test_what_no_frame_can_be_computed_with_is_refused(
    http: httpx.Client, settings: dict[str, object], field: str, limit: str
) -> None:
    answer = http.put(PATH, json=settings)

    assert answer.status_code == 422
    problem = answer.json()
    assert problem["field"] == field
    assert limit in problem["limit"]
    assert http.get(PATH).json()["reconstruction_id"] == 1


def test_streams_are_notified_and_a_lease_keeps_others_out(
    served: Served, http: httpx.Client
) -> None:
    notices: list[Notice] = []
    with (
        Camera(served.url, timeout_s=60) as camera,
        camera.stream("range", on_notice=notices.append) as stream,
    ):
        frames = iter(stream)
        next(frames)
        with camera.lease("bench"):
            assert http.put(PATH, json={"bias": 0.01}).json()["type"] == "/problems/lease-held"
        http.put(PATH, json={"bias": 0.02, "estimator": "pisarenko"})
        frame = next(each for each in frames if each.meta["reconstruction_id"] == 2)

    assert frame.meta["reconstruction_id"] == 2
    reported = [each for each in notices if each.kind == "reconstruction-changed"]
    assert [each.details["reconstruction"]["bias"] for each in reported] == [0.02]
