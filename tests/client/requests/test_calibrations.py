"""Calibrations and jobs of a running daemon, by both cameras."""

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from tests.serving import Served, serving
from transientcam import AsyncCamera, Camera, ProblemError
from transientcam.requests import Calibrations, Jobs, Request


def test_a_name_never_leaves_its_place_in_the_address() -> None:
    paths: list[str] = []

    def note(request: Request[Any]) -> None:
        paths.append(request.path)

    Calibrations(note, note).get("../info?x")
    Jobs(note).cancel("a/b")

    assert paths == ["calibrations/..%2Finfo%3Fx", "jobs/a%2Fb/cancel"]


@pytest.fixture
def daemon() -> Iterator[Served]:
    with serving("sim:calibration") as served:
        yield served


def test_a_camera_measures_uses_and_moves_a_calibration(daemon: Served) -> None:
    progress: list[float] = []
    with Camera(daemon.url, timeout_s=60.0) as camera:
        job = camera.calibrations.measure(name="warm", frames=3)
        done = camera.wait_for(
            job["id"], on_progress=lambda each: progress.append(each["progress"])
        )
        identity = done["result"]["calibration"]
        assert camera.calibrations.active()["id"] == "nominal"
        camera.calibrations.activate(identity)
        assert camera.calibrations.all()["active"] == identity
        content = camera.calibrations.export(identity)
        assert camera.calibrations.undo()["id"] == "nominal"
        assert camera.calibrations.undo()["former"] == "nominal"
        camera.calibrations.activate("nominal")
        camera.calibrations.delete(identity)
        assert camera.calibrations.take_in(content)["name"] == "warm"
        assert camera.calibrations.get(identity)["fits"]
        assert [each["state"] for each in camera.jobs.all()["jobs"]] == ["done"]

    assert progress == sorted(progress)


def test_an_async_camera_does_the_same(daemon: Served) -> None:
    async def main() -> None:
        async with AsyncCamera(daemon.url, timeout_s=60.0) as camera:
            job = await camera.calibrations.measure(frames=2)
            done = await camera.wait_for(job["id"], on_progress=lambda each: None)
            identity = done["result"]["calibration"]
            content = await camera.calibrations.export(identity)
            assert (await camera.calibrations.take_in(content))["id"] == identity
            assert (await camera.jobs.get(job["id"]))["state"] == "done"

    asyncio.run(main())


def test_a_failed_job_is_raised_and_a_cancelled_one_returned(daemon: Served) -> None:
    with Camera(daemon.url, timeout_s=60.0) as camera:
        job = camera.calibrations.measure(frames=2000)
        camera.jobs.cancel(job["id"])
        assert camera.wait_for(job["id"])["state"] == "cancelled"
        camera.cause("unplug")
        job = camera.calibrations.measure(frames=2)
        with pytest.raises(ProblemError) as caught:
            camera.wait_for(job["id"])

    assert caught.value.type == "/problems/camera-lost"


def test_the_reconstruction_is_read_and_changed(daemon: Served) -> None:
    async def main() -> None:
        async with AsyncCamera(daemon.url, timeout_s=60.0) as camera:
            await camera.set_reconstruction({"bias": 0.02})
            assert (await camera.reconstruction())["bias"] == 0.02

    with Camera(daemon.url, timeout_s=60.0) as camera:
        camera.reconstruction = {**camera.reconstruction, "bias": 0.01}
        assert camera.reconstruction["bias"] == 0.01
        names = [each["name"] for each in camera.parameters["parameters"]]
        assert "reconstruction.bias" in names
    asyncio.run(main())
