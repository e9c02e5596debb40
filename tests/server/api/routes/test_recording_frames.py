"""Frames of recordings: computed as those of the camera are, of any that was recorded."""

import io
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import httpx
import numpy as np
import pytest

from tests.server.contract import client_of
from tests.server.recording.made import record
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import wire
from transientcam_server.recording import Recording

RECORDINGS = "/api/v1/recordings"


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(scope="module")
def daemon(directory: Path) -> Iterator[Served]:
    kept, history = {"directory": directory, "min_free_bytes": 0}, {"seconds": 600.0}
    with serving(recordings=kept, history=history) as served:
        served.start_all_workers()
        yield served


@pytest.fixture(scope="module")
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


@pytest.fixture(scope="module")
def recorded(http: httpx.Client) -> str:
    """Address of the frames of a recording of five."""
    return f"{RECORDINGS}/{record_frames(http, 5)}/frames"


def record_frames(http: httpx.Client, frames: int) -> str:
    recording: str = http.post(RECORDINGS, json={"frames": frames}).json()["id"]
    wait_until(lambda: http.get(f"{RECORDINGS}/{recording}").json()["state"] == "complete")
    return recording


def product(http: httpx.Client, address: str, **params: Any) -> wire.Frame:
    response = http.get(address, params=params)
    assert response.status_code == 200, response.text
    return wire.parse_frame(response.content)


def test_a_recording_says_which_frames_it_has_and_when_they_came(
    http: httpx.Client, recorded: str
) -> None:
    found = http.get(recorded).json()

    assert (found["first"], found["last"], found["count"]) == (1, 5, 5)
    assert found["times_s"][0] == 0.0
    assert (np.diff(found["times_s"]) > 0.0).all()
    assert found["duration_s"] == pytest.approx(found["times_s"][-1], abs=1e-6)
    assert found["frame_rate_hz"] == pytest.approx(4 / found["duration_s"])
    assert found["times_step"] == 1


def test_recorded_images_are_those_of_the_file_with_their_labels(
    http: httpx.Client, recorded: str, directory: Path
) -> None:
    raw = product(http, f"{recorded}/3/raw")

    with Recording(directory / f"{recorded.split('/')[4]}.h5") as recording:
        expected = recording.frame(2)
    np.testing.assert_array_equal(raw.array, expected.images)
    assert [dict(each) for each in raw.labels] == [
        asdict(each) | {"kind": each.kind} for each in expected.labels
    ]
    assert raw.frame == 3
    assert raw.meta["device_time_s"] == expected.device_time_s


def test_products_of_a_recorded_frame_are_those_it_had_when_it_was_live(
    daemon: Served, http: httpx.Client
) -> None:
    address = f"{RECORDINGS}/{record_frames(http, 1)}/frames"
    raw = product(http, f"{address}/latest/raw")
    number = next(
        number
        for number in range(daemon.service.history.first or 1, 2**31)
        if http.get(f"/api/v1/frames/{number}").json()["device_time_s"] == raw.meta["device_time_s"]
    )

    for name in ("range", "coefficients", "flags", "pointcloud", "returns"):
        live = product(http, f"/api/v1/frames/{number}/{name}")
        again = product(http, f"{address}/1/{name}")
        np.testing.assert_array_equal(again.array, live.array)
    pixels = [
        http.get(f"{base}/pixel", params={"x": 80, "y": 60}).json()
        for base in (f"/api/v1/frames/{number}", f"{address}/1")
    ]
    for name in ("range_m", "moments", "returns", "density_per_s"):
        assert pixels[1][name] == pixels[0][name]
    assert pixels[1]["truth"] is None


def test_every_format_and_part_can_be_had(http: httpx.Client, recorded: str) -> None:
    cut: dict[str, Any] = {"region": "40,30,64,48", "decimation": 2}
    whole = product(http, f"{recorded}/2/range").array

    part = http.get(f"{recorded}/2/range.npy", params=cut)

    np.testing.assert_array_equal(np.load(io.BytesIO(part.content)), whole[30:78:2, 40:104:2])
    assert json.loads(part.headers["transientcam-meta"])["region"] == [40, 30, 64, 48]
    for name in ("range.png", "range.tiff", "range.csv", "range.npz", "pointcloud.ply"):
        assert http.get(f"{recorded}/2/{name}").status_code == 200
    assert http.get(f"{recorded}/2/pixel.csv", params={"x": 1, "y": 2}).status_code == 200
    assert product(http, f"{recorded}/2/transient", bins=3).array.shape == (3, 120, 163)


def test_the_lens_is_the_one_that_was_recorded(http: httpx.Client, recorded: str) -> None:
    lens = product(http, f"{recorded}/1/pointcloud").extra["intrinsics"]

    live = http.get("/api/v1/camera").json()["intrinsics"]
    assert lens == live | {"source": "recording"}


def test_frames_can_be_had_while_they_are_recorded(http: httpx.Client) -> None:
    started = http.post(RECORDINGS, json={}).json()["id"]
    address = f"{RECORDINGS}/{started}/frames"
    count = 0
    while count < 3:  # whatever it takes; the test's own timeout is the limit
        count = http.get(address).json()["count"]

    number = http.get(f"{address}/latest").json()["frame"]
    range_m = product(http, f"{address}/{number}/range").array

    assert number >= 3
    assert np.isfinite(range_m).any()
    missing = http.get(f"{address}/{number + 1000}")
    assert (missing.status_code, missing.json()["type"]) == (404, "/problems/unknown-frame")
    assert missing.json()["last"] >= number
    http.post(f"{RECORDINGS}/{started}/stop")
    # what was found under another name before is found under the last one, too
    np.testing.assert_array_equal(product(http, f"{address}/{number}/range").array, range_m)
    assert http.get(address).json()["count"] > number - 1


def test_settings_are_those_it_was_recorded_with_unless_todays_are_asked_for(
    http: httpx.Client, recorded: str
) -> None:
    then = product(http, f"{recorded}/4/range")
    before = http.get("/api/v1/reconstruction").json()
    before.pop("reconstruction_id")
    http.put("/api/v1/reconstruction", json=before | {"smoothing_px": 3.0})

    still = product(http, f"{recorded}/4/range")
    now = product(http, f"{recorded}/4/range", reconstruction="current")

    http.put("/api/v1/reconstruction", json=before)
    np.testing.assert_array_equal(still.array, then.array)
    assert not np.array_equal(now.array, then.array, equal_nan=True)
    assert then.meta["reconstruction_id"] == 0
    assert now.meta["reconstruction_id"] > 0


@pytest.mark.parametrize(
    ("path", "status", "slug"),
    [
        ("/6", 404, "unknown-frame"),
        ("/6/range", 404, "unknown-frame"),
        ("/0", 422, "invalid-request"),
        ("/one/range", 422, "invalid-request"),
        ("/1/truth", 404, "unknown-product"),
        ("/1/nothing", 404, "unknown-product"),
        ("/1/moments.png", 406, "not-acceptable"),
        ("/1/range?bins=3", 422, "invalid-request"),
        ("/1/range?region=0,0,999,1", 422, "invalid-request"),
        ("/1/range?reconstruction=none", 422, "invalid-request"),
        ("/1/pixel?x=163&y=0", 422, "invalid-request"),
        ("/1/pixel.csv?x=0&y=120", 422, "invalid-request"),
    ],
)
def test_a_request_that_cannot_be_answered_says_why(
    http: httpx.Client, recorded: str, path: str, status: int, slug: str
) -> None:
    response = http.get(recorded + path)

    assert (response.status_code, response.json()["type"]) == (status, f"/problems/{slug}")


def test_a_recording_that_is_not_there_has_no_frames(http: httpx.Client) -> None:
    for path in ("", "/1", "/latest/range", "/1/pixel?x=0&y=0"):
        response = http.get(f"{RECORDINGS}/nothing/frames{path}")
        assert (response.status_code, response.json()["type"]) == (
            404,
            "/problems/unknown-recording",
        )


def test_a_recording_that_was_deleted_is_not_answered_from_memory(
    http: httpx.Client, directory: Path
) -> None:
    record(directory / "gone.h5", 2)
    assert http.get(f"{RECORDINGS}/gone/frames/1/range").status_code == 200

    http.delete(f"{RECORDINGS}/gone")

    assert http.get(f"{RECORDINGS}/gone/frames/1/range").status_code == 404


def test_a_damaged_frame_is_a_problem_of_its_own(http: httpx.Client, directory: Path) -> None:
    path = record(directory / "hurt.h5", 3)
    with h5py.File(path, "r") as file:
        offset, size = file["raw"].id.get_chunk_info(1)[-2:]
    with path.open("r+b") as file:
        file.seek(offset + size // 2)
        file.write(b"\xff" * 8)
    (directory / "nonsense.h5").write_bytes(b"no HDF5")

    hurt = http.get(f"{RECORDINGS}/hurt/frames/2/range")
    nonsense = http.get(f"{RECORDINGS}/nonsense/frames/1")

    for response in (hurt, nonsense):
        assert (response.status_code, response.json()["type"]) == (
            409,
            "/problems/recording-damaged",
        )
    assert http.get(f"{RECORDINGS}/hurt/frames/3/range").status_code == 200


def test_few_recordings_stay_opened_and_no_file_does(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    for name in ("a", "b", "c"):
        record(directory / f"{name}.h5", 3)
        for number in (1, 2, 3):
            http.get(f"{RECORDINGS}/{name}/frames/{number}/range")

    opened = daemon.service.recorded_frames._opened
    assert list(opened) == ["b", "c"]
    assert all(len(each._frames) <= 2 for each in opened.values())
    for name in ("a", "b", "c"):
        h5py.File(directory / f"{name}.h5", "r+").close()  # refused while any reader has it open
