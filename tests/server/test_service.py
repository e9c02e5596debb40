from typing import Any

import pytest

from tests.server.streaming import streaming
from tests.serving import Served, serving
from transientcam_server.broadcast.channel import Channel
from transientcam_server.camera import AcquisitionStatus

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
