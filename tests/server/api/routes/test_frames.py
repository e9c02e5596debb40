import io
import json
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import transientcam_moments as tm
from tests.serving import Served, serving
from transientcam import Frame, wire
from transientcam_server.imaging._frames import frame as frames
from transientcam_server.settings import ReconstructionSettings

LATEST = "/api/v1/frames/latest"
LABELS = ("harmonic", "phase_rad", "frequency_hz", "illumination", "take")


@pytest.fixture
def served() -> Iterator[Served]:
    """A daemon that forgets nothing while a test lasts, however busy the machine is."""
    with serving("sim:mirrors?noise=off", history={"seconds": 3600.0}) as daemon:
        yield daemon


def wait_for_frame(http: httpx.Client) -> dict[str, Any]:
    for _ in range(12):  # two minutes: a laden machine needs some for the first one
        response = http.get(LATEST, params={"wait_s": 10.0})
        if response.status_code != 503:
            break
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


def test_an_archive_of_raw_images_is_enough_for_the_range(steady: httpx.Client) -> None:
    number = wait_for_frame(steady)["frame"]
    base = f"/api/v1/frames/{number}"
    range_m = npy(steady.get(f"{base}/range.npy"))
    with np.load(io.BytesIO(steady.get(f"{base}/raw.npz").content)) as raw:
        settings = ReconstructionSettings(**json.loads(str(raw["reconstruction"])))
        found = tm.reconstruct(
            raw["array"],
            settings.for_moments(),
            **{name: raw[name] for name in LABELS},
            calibration=raw["gain"],
        )
        assert set(raw["kind"]) == {"modulated"}
        assert raw["weight"].shape == (4, 16)

    same = np.isclose(found.range_m, range_m, atol=1e-3)
    assert same.mean() > 0.999  # the compiled pass of the daemon may round otherwise


@pytest.mark.parametrize("suffix", ["msgpack", "npy", "png"])
def test_a_suffix_names_the_format_whatever_is_accepted(steady: httpx.Client, suffix: str) -> None:
    response = steady.get(f"{LATEST}/range.{suffix}", headers={"Accept": "text/html"})

    types = {"msgpack": wire.MEDIA_TYPE, "npy": "application/x-npy", "png": "image/png"}
    assert response.status_code == 200
    assert response.headers["content-type"] == types[suffix]


def test_npy_and_png_have_frame_unit_and_meta_in_headers(steady: httpx.Client) -> None:
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
    frame = f"/api/v1/frames/{wait_for_frame(http)['frame']}"

    range_m = npy(http.get(f"{frame}/range.npy"))
    image = np.asarray(Image.open(io.BytesIO(http.get(f"{frame}/range.png").content)))

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


def test_a_pixel_reports_everything_about_itself(steady: httpx.Client) -> None:
    response = steady.get(f"{LATEST}/pixel", params={"x": 80, "y": 60, "bins": 50, "wait_s": 10.0})

    pixel = response.json()
    assert (pixel["x"], pixel["y"]) == (80, 60)
    assert len(pixel["time_s"]) == len(pixel["density_per_s"]) == len(pixel["cumulative"]) == 50
    assert len(pixel["moments"]) == 4
    assert pixel["moments"][0] == {"re": pixel["brightness"], "im": 0.0}
    parts = pixel["direct"] + pixel["indirect"] + pixel["uniform"]
    assert parts == pytest.approx(pixel["brightness"], rel=1e-4)
    assert pixel["meta"]["pixels"]["total"] == 163 * 120


def test_frames_that_have_passed_can_be_had_by_their_number(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]
    http.get(LATEST, params={"after": number, "wait_s": 10.0})
    http.put("/api/v1/acquisition", json={"running": False})

    frames = http.get("/api/v1/frames").json()

    assert frames["first"] <= number < frames["last"]
    assert frames["count"] == frames["last"] - frames["first"] + 1
    assert frames["bytes"] == frames["count"] * 16 * 120 * 163 * 2
    for wanted in (frames["first"], frames["last"]):
        assert http.get(f"/api/v1/frames/{wanted}").json()["frame"] == wanted
    first, last = (
        wire.parse_frame(http.get(f"/api/v1/frames/{frames[each]}/raw").content)
        for each in ("first", "last")
    )
    assert (first.frame, last.frame) == (frames["first"], frames["last"])
    assert first.meta["device_time_s"] < last.meta["device_time_s"]
    pixel = http.get(f"/api/v1/frames/{number}/pixel", params={"x": 80, "y": 60}).json()
    assert pixel["meta"]["frame"] == number


def test_a_former_frame_is_computed_as_it_was_when_it_was_the_latest(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]
    then = wire.parse_frame(http.get(f"/api/v1/frames/{number}/range").content).array
    http.get(LATEST, params={"after": number + 1, "wait_s": 10.0})

    now = wire.parse_frame(http.get(f"/api/v1/frames/{number}/range").content).array

    np.testing.assert_array_equal(now, then)


def test_a_former_frame_keeps_the_settings_it_was_captured_under(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]
    then = wire.parse_frame(http.get(f"/api/v1/frames/{number}/range").content)
    http.put("/api/v1/reconstruction", json={"smoothing_px": 3.0, "estimator": "pisarenko"})
    changed = http.get(LATEST).json()["frame"]
    later = http.get(LATEST, params={"after": changed, "wait_s": 10.0}).json()

    now = wire.parse_frame(http.get(f"/api/v1/frames/{number}/range").content)

    assert later["reconstruction_id"] == then.meta["reconstruction_id"] + 1
    assert now.meta["reconstruction_id"] == then.meta["reconstruction_id"]
    np.testing.assert_array_equal(now.array, then.array)


def test_the_truth_of_a_former_frame_is_that_of_its_time() -> None:
    with (
        serving("sim:visitor?noise=off", history={"seconds": 3600.0}) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60.0) as http,
    ):

        def product(number: int, name: str) -> Any:
            query = {"wait_s": 10.0}
            answer = http.get(f"/api/v1/frames/{number}/{name}", params=query).raise_for_status()
            return wire.parse_frame(answer.content).array

        first = late = http.get("/api/v1/frames/2", params={"wait_s": 10.0}).json()["frame"]
        truths = {first: product(first, "truth")}
        moved = np.zeros_like(truths[first], bool)
        while moved.sum() < 500:  # until the visitor has come in
            late += 1
            truths[late] = product(late, "truth")
            moved = np.abs(truths[late] - truths[first]) > 0.2
        ranges = {number: product(number, "range") for number in (first, late)}

    for number, other in ((first, late), (late, first)):
        errors = [np.abs(ranges[number] - truths[each])[moved] for each in (number, other)]
        assert np.nanmedian(errors[0]) < 0.5 * np.nanmedian(errors[1])


def test_a_frame_that_is_still_to_come_can_be_waited_for(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]

    refused = http.get(f"/api/v1/frames/{number + 1000}")
    found = http.get(f"/api/v1/frames/{number + 3}", params={"wait_s": 10.0}).json()

    assert (refused.status_code, refused.json()["type"]) == (404, "/problems/unknown-frame")
    assert refused.json()["last"] >= number
    assert found["frame"] == number + 3


def test_a_frame_that_is_gone_is_reported_so_with_those_that_are_there() -> None:
    with (
        serving("sim:mirrors?noise=off", history={"max_bytes": 4 * 16 * 120 * 163 * 2}) as daemon,
        httpx.Client(base_url=daemon.url, timeout=60.0) as http,
    ):
        http.get("/api/v1/frames/6", params={"wait_s": 10.0})

        problem = http.get("/api/v1/frames/1/range")

    assert (problem.status_code, problem.json()["type"]) == (410, "/problems/frame-gone")
    assert problem.json()["last"] - problem.json()["first"] == 3


@pytest.fixture
def still(http: httpx.Client) -> httpx.Client:
    """A daemon with one frame, of which all products are."""
    wait_for_frame(http)
    http.put("/api/v1/acquisition", json={"running": False})
    return http


def product(http: httpx.Client, name: str, **params: Any) -> Frame:
    response = http.get(f"{LATEST}/{name}", params=params)
    assert response.status_code == 200, response.text
    return wire.parse_frame(response.content)


def test_a_region_and_every_so_many_pixels_of_it_are_cut_out_of_the_whole(
    still: httpx.Client,
) -> None:
    for name in sorted(set(wire.PRODUCTS) - {"streak"}):
        whole = product(still, name)
        part = product(still, name, region="40,30,65,48", decimation=4)

        expected = whole.array[..., 30:78:4, 40:105:4]
        # what is over time is evaluated anew, in vectors of other lengths
        tolerance = 2e-3 * np.nanmax(np.abs(expected)) if "time" in whole.axes else 0.0
        np.testing.assert_allclose(part.array, expected, rtol=0.0, atol=tolerance, err_msg=name)
        assert (part.meta["region"], part.meta["decimation"]) == ([40, 30, 65, 48], 4)
        assert (whole.meta["region"], whole.meta["decimation"]) == ([0, 0, 163, 120], 1)


def test_every_format_has_which_part_it_holds(still: httpx.Client) -> None:
    cut: dict[str, Any] = {"region": "40,30,64,48", "decimation": 2}
    array = still.get(f"{LATEST}/range.npy", params=cut)
    with np.load(io.BytesIO(still.get(f"{LATEST}/range.npz", params=cut).content)) as file:
        meta = json.loads(file["meta"].item())
        np.testing.assert_array_equal(file["array"], npy(array))

    assert (meta["region"], meta["decimation"]) == ([40, 30, 64, 48], 2)
    stated = json.loads(array.headers["transientcam-meta"])
    assert (stated["region"], stated["decimation"]) == ([40, 30, 64, 48], 2)
    assert Image.open(io.BytesIO(still.get(f"{LATEST}/range.png", params=cut).content)).size == (
        32,
        24,
    )


def test_a_streak_is_one_row_of_the_transient(still: httpx.Client) -> None:
    times_s = [0.0, 11.3e-9, 19.3e-9]
    transient = product(still, "transient", time_s=times_s).array

    whole = product(still, "streak", time_s=times_s, y=100)
    part = product(still, "streak", time_s=times_s, y=100, region="10,90,50,20", decimation=5)

    assert (whole.axes, whole.extra["y"]) == (("time", "x"), 100)
    np.testing.assert_allclose(whole.array, transient[:, 100], rtol=2e-3)
    np.testing.assert_allclose(part.array, transient[:, 100, 10:60:5], rtol=2e-3)
    assert product(still, "streak", bins=2).extra["y"] == 60
    picture = still.get(f"{LATEST}/streak.png", params={"view": "colour", "bins": 100})
    assert Image.open(io.BytesIO(picture.content)).size == (163, 100)


def test_the_density_smoothed_lies_between_its_bounds(still: httpx.Client) -> None:
    period_s = 1.0 / 23e6
    fine = product(still, "transient", bins=512, region="80,60,1,1").array[:, 0, 0].astype(float)

    bounds = product(still, "bounds", bins=16, region="80,60,1,1")

    assert bounds.extra["radius"] == 0.93
    lower, upper = bounds.array[:, :, 0, 0]
    phase = 2.0 * np.pi * np.arange(512) / 512
    for k, time_s in enumerate(bounds.extra["time_s"]):
        at = 2.0 * np.pi * time_s / period_s
        kernel = (1 - 0.93**2) / (1 - 2 * 0.93 * np.cos(at - phase) + 0.93**2)
        smoothed = (kernel * fine).mean()
        assert lower[k] <= smoothed * 1.02
        assert upper[k] >= smoothed * 0.98
        assert lower[k] < upper[k]


def test_returns_are_those_of_the_pixel_the_strongest_first(still: httpx.Client) -> None:
    planes = product(still, "returns")
    pixel = still.get(f"{LATEST}/pixel", params={"x": 80, "y": 60}).json()

    time_s, weight = planes.array[0::2, 60, 80], planes.array[1::2, 60, 80]
    expected = sorted(pixel["returns"], key=lambda each: -each["weight"])
    assert planes.unit == "s,DN"
    count = len(expected)
    np.testing.assert_allclose(time_s[:count], [r["time_s"] for r in expected], rtol=1e-3)
    np.testing.assert_allclose(weight[:count], [r["weight"] for r in expected], rtol=1e-2)
    assert np.isnan(time_s[count:]).all()
    assert (weight[count:] == 0.0).all()


def test_a_pointcloud_is_as_far_away_as_the_range_and_says_whose_rays(still: httpx.Client) -> None:
    cloud = product(still, "pointcloud")
    range_m = product(still, "range").array

    lens = cloud.extra["intrinsics"]
    lamp_m = np.array([lens[f"light_{axis}_m"] for axis in "xyz"])[:, None, None]
    back_m, forth_m = (np.linalg.norm(cloud.array - at, axis=0) for at in (0.0, lamp_m))
    np.testing.assert_allclose((back_m + forth_m) / 2, range_m, rtol=1e-5)
    assert lens == still.get("/api/v1/camera").json()["intrinsics"]
    assert cloud.extra["intrinsics"]["source"] == "scene"


def test_a_ply_holds_the_pixels_of_the_pointcloud_that_have_a_range(still: httpx.Client) -> None:
    cut: dict[str, Any] = {"region": "40,30,64,48", "decimation": 3}
    cloud = product(still, "pointcloud", **cut).array
    range_m = product(still, "range", **cut).array
    direct = product(still, "direct", **cut).array

    response = still.get(f"{LATEST}/pointcloud.ply", params=cut)

    assert response.headers["content-type"] == "application/x-ply"
    head, _, body = response.content.partition(b"end_header\n")
    vertex = [("xyz", "<f4", 3), ("range", "<f4"), ("amplitude", "<f4"), ("flags", "u1")]
    vertices = np.frombuffer(body, dtype=vertex)
    there = np.isfinite(range_m)
    assert f"element vertex {there.sum()}" in head.decode()
    np.testing.assert_array_equal(vertices["xyz"], cloud[:, there].T)
    np.testing.assert_array_equal(vertices["range"], range_m[there])
    np.testing.assert_array_equal(vertices["amplitude"], direct[there])


def test_the_impulse_response_of_a_pixel_is_a_table_too(still: httpx.Client) -> None:
    place = {"x": 80, "y": 60, "bins": 50}
    pixel = still.get(f"{LATEST}/pixel", params=place).json()

    response = still.get(f"{LATEST}/pixel.csv", params=place)

    assert response.headers["content-type"].startswith("text/csv")
    table = np.genfromtxt(io.StringIO(response.text), delimiter=",", names=True)
    assert table.dtype.names == (
        "time_s",
        "density_per_s",
        "cumulative",
        "lower_per_s",
        "upper_per_s",
    )
    for name in ("time_s", "density_per_s", "cumulative"):
        np.testing.assert_allclose(table[name], pixel[name], rtol=1e-6)
    np.testing.assert_allclose(table["lower_per_s"], pixel["bounds"]["lower_per_s"], rtol=1e-6)
    assert pixel["bounds"]["radius"] == 0.93


def test_what_many_regions_were_cut_out_is_not_kept_for_ever(
    served: Served, still: httpx.Client
) -> None:
    for x in range(50):
        still.get(f"{LATEST}/range", params={"region": f"{x},0,10,10"})

    frame = served.service.hub.latest
    assert frame is not None
    assert len(frame._crops) <= 32


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
        ("/../soon", 422, "invalid-request", "frame"),
        ("/../0", 422, "invalid-request", "frame"),
        ("/../-1/range", 422, "invalid-request", "frame"),
        ("/../1?after=1", 422, "invalid-request", "after"),
        ("/../999999999", 404, "unknown-frame", "frame"),
        ("/range?region=1,2,3", 422, "invalid-request", "region"),
        ("/range?region=a,0,1,1", 422, "invalid-request", "region"),
        ("/range?region=0,0,164,1", 422, "invalid-request", "region"),
        ("/range?region=0,0,0,1", 422, "invalid-request", "region"),
        ("/range?region=-1,0,5,5", 422, "invalid-request", "region"),
        ("/range?decimation=0", 422, "invalid-request", "decimation"),
        ("/range?decimation=many", 422, "invalid-request", "decimation"),
        ("/range?decimation=99999999", 422, "invalid-request", "decimation"),
        ("/range?y=3", 422, "invalid-request", "y"),
        ("/streak?y=120", 422, "invalid-request", "y"),
        ("/streak?y=5&region=0,10,20,20", 422, "invalid-request", "y"),
        ("/range.ply", 406, "not-acceptable", "suffix"),
        ("/raw.csv", 406, "not-acceptable", "suffix"),
        ("/pixel.csv?x=163&y=0", 422, "invalid-request", "x"),
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
    assert problem["instance"].startswith("/api/v1/frames/")


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
    monkeypatch.setattr(frames, "MAX_ANSWER_BYTES", 10 * 163 * 120 * 4)

    problem = steady.get(f"{LATEST}/transient", params={"bins": 11}).json()

    assert problem["type"] == "/problems/answer-too-large"
    assert (problem["field"], problem["value"], problem["limit"]) == ("time_s", 11, "at most 10")
    assert steady.get(f"{LATEST}/transient", params={"bins": 10}).status_code == 200


def test_what_a_frame_is_worth_is_null_until_computed_or_asked_for(http: httpx.Client) -> None:
    number = wait_for_frame(http)["frame"]
    judged = ("accuracy", "pixels", "neighbours", "predicted_range_std_m")

    bare = http.get(f"/api/v1/frames/{number}").json()
    asked = http.get(f"/api/v1/frames/{number}", params={"computed": True}).json()

    assert bare["accuracy"] is None
    assert all(asked[name] is not None for name in judged)
    # that of every pixel, where a live frame has time for one in sixteen
    error_m = npy(http.get(f"/api/v1/frames/{number}/range_error.npy"))
    assert asked["accuracy"]["range_error_m"] == pytest.approx(np.nanmedian(error_m), rel=0.1)
