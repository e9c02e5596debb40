import io
import json
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from tests.serving import Served
from transientcam import wire
from transientcam_server import pipeline

LATEST = "/api/v1/frames/latest"


def wait_for_frame(http: httpx.Client) -> dict[str, Any]:
    response = http.get(LATEST, params={"wait_s": 10.0})
    assert response.status_code == 200
    document: dict[str, Any] = response.json()
    return document


def npy(response: httpx.Response) -> NDArray[Any]:
    assert response.status_code == 200, response.text
    array: NDArray[Any] = np.load(io.BytesIO(response.content))
    return array


def test_the_meta_of_the_latest_frame_says_how_it_was_captured(
    served: Served, http: httpx.Client
) -> None:
    meta = wait_for_frame(http)

    applied = served.camera.applied
    assert meta["frame"] >= 1
    assert meta["sequence_id"] == applied.epoch
    assert meta["calibration_id"] == "nominal"
    assert (meta["width"], meta["height"]) == (163, 120)
    assert meta["harmonics"] == applied.sequence.harmonics
    assert meta["capture_s"] == pytest.approx(1.0 / applied.frame_rate_hz, rel=0.1)


def test_frame_numbers_grow_and_a_client_can_wait_for_the_next(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]

    following = http.get(LATEST, params={"after": number, "wait_s": 10.0}).json()["frame"]

    assert following > number


def test_without_waiting_a_frame_that_is_not_there_is_a_problem(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]

    response = http.get(LATEST, params={"after": number + 1000})

    assert response.status_code == 503
    assert response.json()["type"] == "/problems/no-frame-yet"


@pytest.mark.parametrize("name", sorted(wire.PRODUCTS))
def test_every_product_comes_as_the_contract_describes_it(steady: httpx.Client, name: str) -> None:
    product = wire.PRODUCTS[name]

    response = steady.get(f"{LATEST}/{name}")

    assert response.headers["content-type"] == wire.MEDIA_TYPE
    message = wire.parse_frame(response.content)
    lengths = {"y": 120, "x": 163, "coefficient": 7, "moment": 4, "image": 16, "time": 64}
    lengths |= {"bound": 2, "return": 6, "coordinate": 3}
    assert (message.product, message.unit, message.axes) == (name, product.unit, product.axes)
    assert message.array.dtype.str == product.dtype
    assert message.array.shape == tuple(lengths[axis] for axis in product.axes)
    assert message.channel is None
    assert message.meta["frame"] >= 1


def test_raw_images_carry_their_labels(served: Served, http: httpx.Client) -> None:
    message = wire.parse_frame(http.get(f"{LATEST}/raw", params={"wait_s": 10.0}).content)

    labels = message.extra["labels"]
    assert len(labels) == len(message.array) == 16
    assert [label["harmonic"] for label in labels] == [0] * 4 + [1] * 4 + [2] * 4 + [3] * 4
    assert labels[5]["phase_rad"] == pytest.approx(np.pi / 2)
    assert labels[5]["frequency_hz"] == pytest.approx(23e6)
    assert all(label["exposure_s"] == served.camera.applied.sequence.exposure_s for label in labels)


@pytest.mark.parametrize("suffix", ["msgpack", "npy", "png"])
def test_a_suffix_names_the_format_whatever_is_accepted(steady: httpx.Client, suffix: str) -> None:
    response = steady.get(f"{LATEST}/range.{suffix}", headers={"Accept": "text/html"})

    types = {"msgpack": wire.MEDIA_TYPE, "npy": "application/x-npy", "png": "image/png"}
    assert response.status_code == 200
    assert response.headers["content-type"] == types[suffix]


def test_npy_and_png_tell_frame_unit_and_meta_in_headers(steady: httpx.Client) -> None:
    wait_for_frame(steady)
    array = steady.get(f"{LATEST}/range.npy")
    image = steady.get(f"{LATEST}/range.png")

    assert array.headers["transientcam-unit"] == "m"
    assert image.headers["transientcam-unit"] == "mm"
    for response in (array, image):
        meta = json.loads(response.headers["transientcam-meta"])
        assert int(response.headers["transientcam-frame"]) == meta["frame"]
        assert meta["pixels"]["total"] == 163 * 120


def test_a_png_of_range_is_its_npy_in_millimetres(http: httpx.Client) -> None:
    http.put("/api/v1/acquisition", json={"running": False})  # so that both are of one frame
    wait_for_frame(http)

    range_m = npy(http.get(f"{LATEST}/range.npy"))
    image = np.asarray(Image.open(io.BytesIO(http.get(f"{LATEST}/range.png").content)))

    np.testing.assert_array_equal(image, np.rint(np.nan_to_num(range_m.astype(float)) * 1e3))


def test_a_coloured_png_is_for_eyes(steady: httpx.Client) -> None:
    response = steady.get(f"{LATEST}/range.png", params={"view": "colour", "wait_s": 10.0})

    assert Image.open(io.BytesIO(response.content)).mode == "P"


def test_a_transient_is_evaluated_at_the_times_asked_for(steady: httpx.Client) -> None:
    times_s = [0.0, 11.3e-9, 19.3e-9]

    message = wire.parse_frame(
        steady.get(f"{LATEST}/transient", params={"time_s": times_s, "wait_s": 10.0}).content
    )

    assert message.array.shape == (3, 120, 163)
    assert message.extra["time_s"] == times_s


def test_bins_are_spread_over_one_period_of_the_base_frequency(steady: httpx.Client) -> None:
    message = wire.parse_frame(
        steady.get(f"{LATEST}/cumulative", params={"bins": 5, "wait_s": 10.0}).content
    )

    np.testing.assert_allclose(message.extra["time_s"], np.arange(5) / (5 * 23e6), rtol=1e-12)


def test_a_pixel_tells_everything_about_itself(steady: httpx.Client) -> None:
    response = steady.get(f"{LATEST}/pixel", params={"x": 80, "y": 60, "bins": 50, "wait_s": 10.0})

    pixel = response.json()
    assert (pixel["x"], pixel["y"]) == (80, 60)
    assert len(pixel["time_s"]) == len(pixel["density_per_s"]) == len(pixel["cumulative"]) == 50
    assert len(pixel["moments"]) == 4
    assert pixel["moments"][0] == {"re": pixel["brightness"], "im": 0.0}
    parts = pixel["direct"] + pixel["indirect"] + pixel["uniform"]
    assert parts == pytest.approx(pixel["brightness"], rel=1e-4)
    assert pixel["meta"]["pixels"]["total"] == 163 * 120


@pytest.mark.parametrize(
    ("path", "status", "slug", "field"),
    [
        ("/nothing", 404, "unknown-product", "product"),
        ("/nothing.npy", 404, "unknown-product", "product"),
        ("/range.bmp", 406, "not-acceptable", "suffix"),
        ("/range.", 406, "not-acceptable", "suffix"),
        ("/range.npy.png", 406, "not-acceptable", "suffix"),
        ("/moments.png", 406, "not-acceptable", "suffix"),
        ("/range?bins=5", 422, "invalid-request", "bins"),
        ("/range?time_s=1e-9", 422, "invalid-request", "time_s"),
        ("/transient?time_s=1e-9&bins=3", 422, "invalid-request", "bins"),
        ("/transient?time_s=nan", 422, "invalid-request", "time_s.0"),
        ("/transient?time_s=soon", 422, "invalid-request", "time_s.0"),
        ("/transient?bins=0", 422, "invalid-request", "bins"),
        ("/transient?bins=4097", 422, "invalid-request", "bins"),
        ("/transient?bins=2.5", 422, "invalid-request", "bins"),
        ("/range.png?view=grey", 422, "invalid-request", "view"),
        ("/range?wait_s=11", 422, "invalid-request", "wait_s"),
        ("/range?wait_s=nan", 422, "invalid-request", "wait_s"),
        ("/range?wait_s=-1", 422, "invalid-request", "wait_s"),
        ("?after=-1", 422, "invalid-request", "after"),
        ("/pixel?x=163&y=0", 422, "invalid-request", "x"),
        ("/pixel?x=0&y=120", 422, "invalid-request", "y"),
        ("/pixel?x=-1&y=0", 422, "invalid-request", "x"),
        ("/pixel?y=0", 422, "invalid-request", "x"),
        ("/pixel?x=left&y=0", 422, "invalid-request", "x"),
        ("/pixel?x=0&y=0&bins=5000", 422, "invalid-request", "bins"),
    ],
)
def test_a_request_that_cannot_be_answered_names_the_field(
    steady: httpx.Client, path: str, status: int, slug: str, field: str
) -> None:
    response = steady.get(f"{LATEST}{path}")

    problem = response.json()
    assert (response.status_code, problem["type"]) == (status, f"/problems/{slug}")
    assert problem["field"] == field
    assert problem["instance"].startswith(LATEST)


def test_an_unknown_product_is_answered_with_the_known_ones(steady: httpx.Client) -> None:
    problem = steady.get(f"{LATEST}/nothing").json()

    assert problem["known"] == sorted(wire.PRODUCTS)


def test_an_unsupported_format_is_answered_with_the_supported_ones(steady: httpx.Client) -> None:
    problem = steady.get(f"{LATEST}/moments", headers={"Accept": "image/png"}).json()

    assert problem["status"] == 406
    assert problem["supported"] == ["msgpack", "npy", "npz"]


def test_an_answer_too_large_for_memory_is_refused_before_it_is_computed(
    steady: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "MAX_ANSWER_BYTES", 10 * 163 * 120 * 4)

    problem = steady.get(f"{LATEST}/transient", params={"bins": 11}).json()

    assert problem["type"] == "/problems/answer-too-large"
    assert (problem["field"], problem["value"], problem["limit"]) == ("time_s", 11, "at most 10")
    assert steady.get(f"{LATEST}/transient", params={"bins": 10}).status_code == 200
