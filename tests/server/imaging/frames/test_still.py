"""Frames of a stream are averaged in the order of their capture, whoever asks for which."""

import asyncio
import threading
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from transientcam_driver import Camera, RawFrame, open_camera
from transientcam_server.imaging import Frame, Pipeline, Recipe, Workers
from transientcam_server.imaging._frames.still import MOST_WAITING
from transientcam_server.settings import ReconstructionSettings

SETTINGS = ReconstructionSettings(still_frames=8, neighbours="none")


@pytest.fixture(scope="module")
def camera() -> Iterator[Camera]:
    with open_camera("sim:wall?noise=off") as opened:
        yield opened


@pytest.fixture(scope="module")
def raws(camera: Camera) -> list[RawFrame]:
    """Captures of the same with other noise: no sensor states it, the images do."""
    camera.start()
    raw = camera.read_frame()
    camera.stop()
    random = np.random.default_rng(1)
    noise = random.normal(0, 60, (8, *raw.images.shape))
    most = 2**camera.capabilities.bits - 2
    noisy = np.clip(np.rint(raw.images + noise), 0, most).astype(np.uint16)
    return [
        replace(raw, number=7 + k, lost_images=0, images=images) for k, images in enumerate(noisy)
    ]


def with_pipeline(camera: Camera, test: Callable[[Pipeline], Awaitable[None]]) -> None:
    async def main() -> None:
        with ThreadPoolExecutor(2) as executor:
            workers = Workers(executor, count=2)
            try:
                await test(Pipeline(camera, SETTINGS, workers))
            finally:
                await workers.close(within_s=30.0)

    asyncio.run(main())


async def frames_averaged(pipeline: Pipeline, frame: Frame) -> float:
    product = await frame.product(pipeline.product("frames_averaged"))
    median = float(np.median(product))
    stated = frame.meta()["frames_averaged"]
    assert stated == (
        None if frame.averaged is None else {"median": median, "least": product.min()}
    )
    return median


def test_each_rests_on_those_before_it_whichever_is_asked_for(
    camera: Camera, raws: list[RawFrame]
) -> None:
    async def test(pipeline: Pipeline) -> None:
        frames = [pipeline.frame(raw, camera.applied) for raw in raws[:6]]
        found = [await frames_averaged(pipeline, frames[at]) for at in (5, 1, 3)]
        assert found == [6, 2, 4]
        range_, own = pipeline.product("range"), pipeline.product("measured_moments")
        ranges = [await frame.product(range_) for frame in frames]
        scatter = [np.nanmedian(abs(each - np.nanmedian(ranges, axis=0))) for each in ranges]
        assert scatter[0] > 1.5 * scatter[3]
        alone = Frame(pipeline.workers, 1, raws[5], frames[5].recipe)
        assert np.array_equal(await alone.product(own), await frames[5].product(own))
        later = frames[5].bare().bare()
        assert np.array_equal(await later.product(range_), ranges[5], equal_nan=True)
        assert later.size_bytes > alone.size_bytes

    with_pipeline(camera, test)


def test_it_begins_anew_after_a_gap_and_with_other_settings(
    camera: Camera, raws: list[RawFrame]
) -> None:
    async def test(pipeline: Pipeline) -> None:
        shown = [raws[0], raws[1], raws[3], replace(raws[4], lost_images=1), raws[5]]
        frames = [pipeline.frame(raw, camera.applied) for raw in shown]
        wanted = SETTINGS.model_copy(update={"bias": 0.01})
        pipeline.reconstruction = pipeline.reconstruction.followed_by(wanted)
        frames += [pipeline.frame(raw, camera.applied) for raw in raws[6:8]]
        found = [await frames_averaged(pipeline, frame) for frame in frames]
        assert found == [1, 2, 1, 1, 2, 1, 2]

    with_pipeline(camera, test)


def test_where_averaging_does_not_keep_up_a_frame_stands_alone(
    camera: Camera, raws: list[RawFrame], monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = threading.Event()
    average = Recipe.average

    def waits(self: Recipe, *arguments: object) -> object:
        ended.wait(60.0)
        return average(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Recipe, "average", waits)

    async def test(pipeline: Pipeline) -> None:
        many = [replace(raws[0], number=k) for k in range(MOST_WAITING + 1)]
        frames = [pipeline.frame(raw, camera.applied) for raw in many]
        assert [frame.averaged is None for frame in frames] == [False] * MOST_WAITING + [True]
        ended.set()
        assert await frames_averaged(pipeline, frames[-1]) == 1
        assert await frames_averaged(pipeline, frames[-2]) == MOST_WAITING

    with_pipeline(camera, test)


def test_a_frame_whose_averaging_fails_is_computed_by_itself(
    camera: Camera, raws: list[RawFrame], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*arguments: object) -> None:
        raise ArithmeticError("no mean")

    async def test(pipeline: Pipeline) -> None:
        with monkeypatch.context() as patched:
            patched.setattr(Recipe, "average", fails)
            frame = pipeline.frame(raws[0], camera.applied)
            assert np.isfinite(await frame.product(pipeline.product("range"))).any()
        assert frame.meta()["frames_averaged"] is None
        following = pipeline.frame(raws[1], camera.applied)
        assert await frames_averaged(pipeline, following) == 1

    with_pipeline(camera, test)
