import asyncio
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.server.streaming import PATIENCE_S, streaming
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import wire
from transientcam_server.broadcast import Channel
from transientcam_server.camera import AcquisitionStatus
from transientcam_server.imaging import Workers

HEALTHY: dict[str, Any] = {
    "state": "streaming",
    "running": True,
    "rate_hz": 10.6,
    "frames": 5,
    "frame_age_s": 0.05,
    "reason": None,
    "stalled": False,
    "offs": 0,
}


@pytest.mark.parametrize(
    ("changes", "reasons"),
    [
        ({}, []),
        ({"state": "stopped", "running": False, "frame_age_s": 900.0}, []),
        ({"state": "lost", "reason": "it was unplugged"}, ["camera is lost: it was unplugged"]),
        ({"stalled": True, "frame_age_s": 3.25}, ["no frame arrived for 3.2 s"]),
    ],
)
def test_readiness_says_why_there_are_no_frames(
    steady_daemon: Served,
    monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, Any],
    reasons: list[str],
) -> None:
    service = steady_daemon.service
    status = AcquisitionStatus(**(HEALTHY | changes))
    monkeypatch.setattr(service.acquisition, "status", lambda: status)

    found = service.not_ready()

    assert len(found) == len(reasons)
    assert all(reason in each for reason, each in zip(reasons, found, strict=True))


@pytest.mark.parametrize("state", ["starting", "streaming"])
def test_a_camera_that_has_not_delivered_yet_is_starting(
    steady_daemon: Served, monkeypatch: pytest.MonkeyPatch, state: str
) -> None:
    service = steady_daemon.service
    status = AcquisitionStatus(**(HEALTHY | {"state": state, "frames": 0}))
    monkeypatch.setattr(service.acquisition, "status", lambda: status)

    assert service.not_ready() == ["the camera is starting"]


def test_channels_are_described_with_the_present_sequence(steady_daemon: Served) -> None:
    service = steady_daemon.service
    product = service.pipeline.product("raw")

    (described,) = service.channel_table([Channel(3, product, None)])

    assert described.channel == 3
    assert described.shape == (service.applied.images, 120, 163)
    assert described.dtype == "<u2"


def test_the_loop_is_left_to_requests_without_viewers() -> None:
    with serving("sim:wall?noise=off") as daemon:
        before = daemon.service.watched
        with streaming(daemon.stream_url) as client:
            client.subscribe("flags")
            client.frame()
            during = daemon.service.watched

    assert (before, during) == (False, True)


def test_the_camera_is_stopped_at_the_end_whatever_is_computed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stopped = threading.Event()
    waits: list[bool] = []

    def compute() -> None:
        waits.append(stopped.wait(PATIENCE_S))

    with serving("sim:wall?noise=off", workers=2) as daemon:
        service = daemon.service
        stop = service.acquisition.stop

        def stop_and_say_so() -> None:
            stop()
            stopped.set()

        monkeypatch.setattr(service.acquisition, "stop", stop_and_say_so)
        computing = threading.Thread(target=asyncio.run, args=(_each(service.workers, compute, 2),))
        computing.start()
    computing.join()

    assert waits == [True, True]


async def _each(workers: Workers, compute: Callable[[], None], count: int) -> None:
    await asyncio.gather(*(workers.run(compute) for _ in range(count)))


# -- the light ----------------------------------------------------------------------------------


def acquisition(served: Served) -> dict[str, Any]:
    document: dict[str, Any] = httpx.get(f"{served.url}/api/v1/acquisition").json()
    return document


@pytest.mark.parametrize("off", ["safe-off", "stop"])
def test_a_light_that_was_switched_off_stays_so_over_restarts_until_it_is_started(
    tmp_path: Path, off: str
) -> None:
    light = {"directory": tmp_path, "delay_s": 0.0, "unused_s": 0.0}
    with serving("sim:wall?noise=off", light=light) as served:
        assert acquisition(served)["off_because"] is None
        if off == "safe-off":
            httpx.post(f"{served.url}/api/v1/acquisition/safe-off").raise_for_status()
        else:
            httpx.put(f"{served.url}/api/v1/acquisition", json={"running": False})
    for _ in range(2):
        with serving("sim:wall?noise=off", light=light) as served:
            found = acquisition(served)
            assert (found["state"], found["off_because"], found["off_kept"]) == (
                ("stopped", off, True)
            )
    with serving("sim:corner?noise=off", light=light) as served:
        assert acquisition(served)["running"]
    with serving("sim:wall?noise=off", light=light) as served:
        httpx.put(f"{served.url}/api/v1/acquisition", json={"running": True}).raise_for_status()
    with serving("sim:wall?noise=off", light=light) as served:
        assert acquisition(served)["running"]


def test_where_a_light_that_is_off_cannot_be_kept_none_is_switched_on_by_itself(
    tmp_path: Path,
) -> None:
    (tmp_path / "light").write_text("no directory", encoding="utf-8")
    light = {"directory": tmp_path / "light", "delay_s": 0.0, "unused_s": 0.0}
    with serving("sim:wall?noise=off", light=light) as served:
        found = acquisition(served)
        httpx.put(f"{served.url}/api/v1/acquisition", json={"running": True}).raise_for_status()
        started = acquisition(served)["running"]
        off = httpx.post(f"{served.url}/api/v1/acquisition/safe-off")

    assert found["off_because"] in ("unreadable", "unwritable")
    assert str(tmp_path / "light") in found["reason"]
    assert started  # somebody wants it
    assert (off.status_code, off.json()["off_kept"]) == (200, False)


def test_a_capture_that_nobody_uses_ends_and_stays_ended(tmp_path: Path) -> None:
    light = {"directory": tmp_path, "delay_s": 0.0, "unused_s": 0.3}
    with serving("sim:wall?noise=off", light=light) as served:
        wait_until(lambda: acquisition(served)["state"] == "stopped")
        found = acquisition(served)

    assert found["off_because"] == "unused"
    assert "0.3 s" in found["reason"]


def test_viewers_readers_recordings_jobs_and_leases_use_the_capture(tmp_path: Path) -> None:
    settings: dict[str, Any] = {"recordings": {"directory": tmp_path, "min_free_bytes": 0}}
    with serving("sim:wall?noise=off", **settings) as served:
        service, url = served.service, f"{served.url}/api/v1"
        used = [service._is_used()]
        with streaming(served.stream_url) as client:
            wait_until(lambda: service.hub.clients == 1)
            used.append(service._is_used())  # it has not subscribed
            client.subscribe("flags")
            client.frame()
            used.append(service._is_used())
        wait_until(lambda: not service._is_used())
        lease = httpx.post(f"{url}/lease", json={"holder": "me"}).json()
        used.append(service._is_used())
        mine = {wire.LEASE_HEADER: lease["lease_id"]}
        httpx.delete(f"{url}/lease", headers=mine).raise_for_status()
        recording = httpx.post(f"{url}/recordings", json={}).json()
        used.append(service._is_used())
        httpx.post(f"{url}/recordings/{recording['id']}/stop").raise_for_status()
        with httpx.stream("GET", f"{url}/preview.mjpeg") as preview:
            next(preview.iter_raw())
            used.append(service._is_used())
        wait_until(lambda: not service._is_used())
        busy = threading.Event()
        service.acquisition.submit(lambda: busy.wait(PATIENCE_S))  # or the job might have ended
        job = httpx.post(f"{url}/calibrations", json={"frames": 2}).json()
        used.append(service._is_used())
        busy.set()
        httpx.post(f"{url}/jobs/{job['id']}/cancel").raise_for_status()
        wait_until(lambda: not service._is_used())
        before = service.hub.reads
        httpx.get(f"{url}/frames/latest", params={"wait_s": 10.0}).raise_for_status()
        read = service.hub.reads

    assert used == [False, False, True, True, True, True, True]
    assert read > before
