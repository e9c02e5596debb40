import asyncio
import threading
from collections.abc import Callable
from typing import Any

import pytest

from tests.server.streaming import PATIENCE_S, streaming
from tests.serving import Served, serving
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
