"""The best averaging time over REST: of the running camera, and of a recording."""

from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.server.contract import client_of
from tests.server.recording.made import record
from tests.serving import serving
from transientcam import Camera


def end_of(client: httpx.Client, **request: Any) -> dict[str, Any]:
    job = client.post("/api/v1/stability/jobs", json=request).json()
    while job["finished_at"] is None:
        job = client.get(f"/api/v1/jobs/{job['id']}", params={"wait_s": 30}).json()
    return job


def test_frames_that_come_and_those_of_a_recording_tell_it(tmp_path: Path) -> None:
    record(tmp_path / "20261120T081500Z-3f9c2a.h5", 17)
    folder = {"directory": tmp_path}
    with serving("sim:wall?seed=2", recordings=folder) as daemon, client_of(daemon) as client:
        with Camera(daemon.url) as camera:
            started = camera.start_stability(16, region=[40, 30, 20, 10])
            live = camera.wait_for(started["id"])["result"]
        recorded = end_of(client, recording="20261120T081500Z-3f9c2a")["result"]
        unknown = end_of(client, recording="none")

    assert (live["frames"], live["pixels"]) == (16, 200)
    assert 0 < live["median_m"][0] <= live["p90_m"][0] < 0.1
    assert live["best_frames"] in (1, 2)
    assert (recorded["frames"], recorded["every_s"]) == (17, pytest.approx(0.1))
    assert (unknown["state"], unknown["problem"]["type"]) == (
        "failed",
        "/problems/unknown-recording",
    )
