"""What a frame says of images that lost their synchronisation, live and in recordings."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from transientcam.documents import FrameDocument
from transientcam_driver import AppliedSequence, Camera, RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import Pipeline, Workers
from transientcam_server.settings import ReconstructionSettings

PAIR = (7, 9)
"""Opposite images of a frequency, by their index in a take."""


@pytest.fixture(scope="module")
def camera() -> Any:
    with open_camera("sim:wall", clock=VirtualClock()) as found:
        yield found


def captured(camera: Camera, take_order: Any = "sequential", takes: int = 1) -> list[RawFrame]:
    camera.configure(Sequence(harmonics=3, zeroth="on-off", takes=takes, take_order=take_order))
    camera.start()
    frames = [camera.read_frame() for _ in range(2)]
    camera.stop()
    return frames


def spoil(frame: RawFrame, *images: int) -> RawFrame:
    """Light in opposite phase in the one image, in quadrature in another."""
    out = frame.images.copy()
    for number, place in enumerate(images):
        for take in range(frame.labels[-1].take + 1):
            index = frame.index_of(take, place)
            other = frame.index_of(take, place - 1 if number else place - 2)
            out[index] = frame.images[other]
    return replace(frame, images=out)


def metas(
    camera: Camera, frames: list[RawFrame], applied: AppliedSequence, spoilt_images: Any
) -> list[FrameDocument]:
    async def main() -> list[FrameDocument]:
        with ThreadPoolExecutor(2) as executor:
            workers = Workers(executor, count=2)
            settings = ReconstructionSettings(spoilt_images=spoilt_images)
            pipeline = Pipeline(camera, settings, workers)
            found = []
            for raw in frames:
                frame = pipeline.frame(raw, applied).bare()  # as history gives it
                await frame.reconstruction("light")
                found.append(frame.meta())
            await workers.close(within_s=60.0)
            return found

    return asyncio.run(main())


def test_a_rebuilt_image_is_counted(camera: Camera) -> None:
    first, second = captured(camera)

    good, spoilt = metas(camera, [first, spoil(second, PAIR[1])], camera.applied, "repair")

    assert (good["repaired_images"], good["unrepaired_images"], good["filled_images"]) == (0, 0, [])
    assert (spoilt["repaired_images"], spoilt["unrepaired_images"]) == (1, 0)


@pytest.mark.parametrize("take_order", ["sequential", "interleaved"])
def test_images_of_the_frame_before_are_named_by_their_index(
    camera: Camera, take_order: Any
) -> None:
    takes = 2
    first, second = captured(camera, take_order, takes)
    both = spoil(second, PAIR[1], PAIR[0])

    filled = metas(camera, [first, both], camera.applied, "fill")[1]
    repaired = metas(camera, [first, both], camera.applied, "repair")[1]

    expected = {second.index_of(take, place) for take in range(takes) for place in PAIR}
    assert set(filled["filled_images"] or ()) == expected
    assert all(second.labels[index].harmonic == 2 for index in expected)
    assert filled["unrepaired_images"] == 0
    assert (repaired["filled_images"], repaired["unrepaired_images"]) == ([], 4)


def test_nothing_is_filled_in_from_another_sequence(camera: Camera) -> None:
    first, second = captured(camera)
    both = replace(spoil(second, PAIR[1], PAIR[0]), epoch=first.epoch + 1)

    meta = metas(camera, [first, both], camera.applied, "fill")[1]

    assert (meta["filled_images"], meta["unrepaired_images"]) == ([], 2)


def test_a_capture_is_kept_with_the_next_one_only_where_it_is_needed(camera: Camera) -> None:
    first, second = captured(camera)
    for spoilt_images, kept in (("repair", None), ("fill", first)):
        with ThreadPoolExecutor(2) as executor:
            settings = ReconstructionSettings(spoilt_images=spoilt_images)  # type: ignore[arg-type]
            pipeline = Pipeline(camera, settings, Workers(executor, count=2))
            pipeline.frame(first, camera.applied)

            assert pipeline.frame(second, camera.applied).previous is kept


def test_takes_and_places_lead_to_the_images_they_come_from(camera: Camera) -> None:
    for take_order in ("sequential", "interleaved"):
        frame = captured(camera, take_order, 3)[0]
        for take, place in ((0, 0), (1, 5), (2, 13)):
            index = frame.index_of(take, place)
            np.testing.assert_array_equal(frame.images[index], frame.by_take[take, place])
