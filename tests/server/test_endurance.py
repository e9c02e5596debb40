"""What happens to a service in months: unplugs without number, clocks that jump, bad frames."""

import itertools
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.server.contract import client_of
from tests.server.streaming import Client, streaming
from tests.serving import Served, serving
from transientcam import wire
from transientcam_driver import RawFrame
from transientcam_server.recording import Recording

UNPLUGS = 8
A_DAY_S = 86_400.0


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    """Where recordings go."""
    return tmp_path / "recordings"


@pytest.fixture
def served(directory: Path) -> Iterator[Served]:
    recordings = {"directory": directory, "min_free_bytes": 0}
    with serving("sim:mirrors?noise=off", recordings=recordings) as daemon:
        daemon.start_all_workers()
        yield daemon


@pytest.fixture
def http(served: Served) -> Iterator[httpx.Client]:
    with client_of(served, "/api/v1/") as client:
        yield client


def cause(http: httpx.Client, fault: str) -> None:
    assert http.post("simulation/faults", json={"fault": fault}).status_code == 200


def stopped(http: httpx.Client, recording: str) -> dict[str, Any]:
    document: dict[str, Any] = http.post(f"recordings/{recording}/stop").json()
    return document


def open_descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def test_unplugged_again_and_again_under_load_it_comes_back_and_nothing_grows(
    served: Served, http: httpx.Client, directory: Path
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("range", "coefficients")
        first = client.frame().meta["frame"]
        sequence = http.get("sequence").json()
        threads, descriptors = threading.active_count(), open_descriptors()
        recording = http.post("recordings", json={}).json()["id"]
        for _ in range(UNPLUGS):
            cause(http, "unplug")
            client.notice("camera-lost")
            cause(http, "replug")
            client.notice("camera-back")
            number = client.frame().meta["frame"]
            assert number > first
            first = number
        after = http.get("sequence").json()
        document = stopped(http, recording)
        # the recorder's thread and file may not be gone yet
        left = threading.active_count() - threads, open_descriptors() - descriptors

    assert max(left) <= 1
    assert {key: after[key] for key in sequence if key != "sequence_id"} == {
        key: value for key, value in sequence.items() if key != "sequence_id"
    }
    assert (document["state"], document["reason"]) == ("complete", "stopped")
    assert document["frames"] >= UNPLUGS
    with Recording(directory / f"{recording}.h5") as read:
        numbers = [raw.device_time_s for raw in read]
    assert len(numbers) == document["frames"]


@pytest.fixture
def jump(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Let the clock of the host jump, for every later reading."""
    real, offset_s = time.time, [0.0]
    monkeypatch.setattr(time, "time", lambda: real() + offset_s[0])

    def jump(by_s: float) -> None:
        offset_s[0] += by_s

    return jump


@pytest.mark.parametrize("by_s", [-A_DAY_S, A_DAY_S], ids=["back", "forward"])
def test_a_clock_that_jumps_ends_no_lease_no_stream_and_no_recording(
    served: Served, http: httpx.Client, jump: Callable[[float], None], by_s: float
) -> None:
    lease = http.post("lease", json={"holder": "bench 2", "duration_s": 600.0}).json()
    http.headers[wire.LEASE_HEADER] = lease["lease_id"]
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        client.frame()
        recording = http.post("recordings", json={"duration_s": 3600.0}).json()["id"]
        client.frame()

        jump(by_s)
        following = [client.frame() for _ in range(4)]

        held = http.get("lease").json()
        ready = httpx.get(f"{served.url}/readyz")
        acquisition = http.get("acquisition").json()
        document = stopped(http, recording)

    numbers = [each.meta["frame"] for each in following]
    assert numbers == sorted(set(numbers))
    times_s = [each.meta["device_time_s"] for each in following]
    assert times_s == sorted(set(times_s))  # by a clock that is never set
    assert held["held"]
    assert 0.0 < held["expires_in_s"] <= 600.0
    assert ready.status_code == 200
    assert acquisition["state"] == "streaming"
    assert 0.0 <= acquisition["frame_age_s"] < 60.0
    assert (document["state"], document["reason"]) == ("complete", "stopped")
    assert 0.0 <= document["duration_s"] < 60.0


def test_recordings_of_the_same_second_are_two(
    http: httpx.Client, jump: Callable[[float], None]
) -> None:
    ids = []
    for _ in range(2):
        ids.append(http.post("recordings", json={"frames": 1}).json()["id"])
        stopped(http, ids[-1])
        jump(-1.0)

    assert len(set(ids)) == 2
    listed = [each["id"] for each in http.get("recordings").json()["recordings"]]
    assert sorted(listed) == sorted(ids)


def black(raw: RawFrame) -> RawFrame:
    return replace(raw, images=np.zeros_like(raw.images))


def beyond_its_bits(raw: RawFrame) -> RawFrame:
    return replace(raw, images=np.full_like(raw.images, 65535))


def without_its_last_image(raw: RawFrame) -> RawFrame:
    return replace(raw, images=raw.images[:-1])


def of_one_pixel(raw: RawFrame) -> RawFrame:
    return replace(raw, images=np.ascontiguousarray(raw.images[:, :1, :1]))


@pytest.mark.parametrize("poison", [black, beyond_its_bits, without_its_last_image, of_one_pixel])
def test_a_poisoned_frame_hurts_no_other(
    served: Served, http: httpx.Client, monkeypatch: pytest.MonkeyPatch, poison: Any
) -> None:
    camera, count = served.camera, itertools.count()
    read = camera.read_frame

    def every_third(**options: Any) -> RawFrame:
        raw = read(**options)
        return poison(raw) if next(count) % 3 == 0 else raw

    monkeypatch.setattr(camera, "read_frame", every_third)
    with streaming(served.stream_url) as client:
        client.subscribe("range", "flags")
        fine = _fine_frames(client, 4)
        statuses = [
            http.get("frames/latest/range", params={"wait_s": 10.0, "after": frame}).status_code
            for frame in fine
        ]

    assert len(set(fine)) == 4
    assert set(statuses) <= {200, 500}  # of a frame that is one of the poisoned
    assert httpx.get(f"{served.url}/livez").status_code == 200


def _fine_frames(client: Client, count: int) -> list[int]:
    """Return the numbers of frames with range, passing over those without and over problems."""
    numbers: list[int] = []
    while len(numbers) < count:
        message = client.receive()
        if isinstance(message, wire.Frame) and message.product == "range":
            finite = np.isfinite(message.array)
            if message.array.shape == (120, 163) and finite.any():
                numbers.append(message.meta["frame"])
    return numbers
