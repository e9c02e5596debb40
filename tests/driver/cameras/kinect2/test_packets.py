"""Packets of the isochronous endpoint become frames, also where some of them are missing."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.driver.cameras.kinect2.conftest import Load
from transientcam_driver.cameras.kinect2 import MEASURED, SUB_IMAGE_BYTES, Assembler
from transientcam_driver.cameras.kinect2._encoder import MAGIC, packets
from transientcam_driver.cameras.kinect2._packets import Footer, SubImages

PER_SUB_IMAGE = 10  # nine with data, one of length zero
PER_FRAME = 10 * PER_SUB_IMAGE


@pytest.fixture(scope="module")
def images() -> NDArray[np.uint8]:
    return np.random.default_rng(3).integers(0, 256, (MEASURED, SUB_IMAGE_BYTES), np.uint8)


def stream(images: NDArray[np.uint8], *sequences: int) -> list[bytes]:
    return [
        each
        for sequence in sequences
        for each in packets(images, sequence=sequence, timestamp=266 * sequence % 2**32)
    ]


def received(assembler: Assembler, sent: Iterable[bytes]) -> list[SubImages]:
    return [frame for frame in map(assembler.push, sent) if frame is not None]


@pytest.mark.data
def test_the_stream_that_libfreenect2_reads_is_the_frame_that_it_reads(vectors: Load) -> None:
    stored = vectors("stream")
    ends = np.cumsum(stored["packet_lengths"])
    sent = [each.tobytes() for each in np.split(stored["data"], ends[:-1])]
    assembler = Assembler()

    # before the tenth sub-image has come
    (frame,) = received(assembler, sent[: 9 * PER_SUB_IMAGE - 1])

    assert (frame.sequence, frame.timestamp, frame.lost) == (1001, 52_000, 0)
    whole = vectors("ramp")["packet"].reshape(10, -1)
    assert (frame.data == whole[:MEASURED]).all()
    assert received(assembler, sent[9 * PER_SUB_IMAGE - 1 :]) == []
    assert assembler.torn == 0
    assert list(packets(whole, sequence=1001, timestamp=52_000)) == sent[:PER_FRAME]


@pytest.mark.parametrize("lost", [0, 3, 8, 45, 88])
@pytest.mark.parametrize("with_the_end", [False, True])
def test_a_lost_packet_costs_its_frame_and_no_other(
    images: NDArray[np.uint8], lost: int, *, with_the_end: bool
) -> None:
    sent = stream(images, 7, 8, 9)
    end = lost - lost % PER_SUB_IMAGE + PER_SUB_IMAGE - 1
    gone = {PER_FRAME + lost, PER_FRAME + end} if with_the_end else {PER_FRAME + lost}
    assembler = Assembler()

    frames = received(assembler, (each for at, each in enumerate(sent) if at not in gone))

    # without the last piece and the end behind it, the next sub-image grows too long as well
    both = with_the_end and lost % PER_SUB_IMAGE == 8 and lost < 80
    assert [(each.sequence, each.lost) for each in frames] == [(7, 0), (9, 1 + both)]
    assert all((each.data == images).all() for each in frames)
    assert assembler.torn == 1
    assert assembler.incomplete_frames == 1
    assert assembler.lost == 1 + both


def test_a_lost_end_of_a_sub_image_costs_nothing(images: NDArray[np.uint8]) -> None:
    assembler = Assembler()

    frames = received(assembler, filter(None, stream(images, 1, 2)))

    assert [each.sequence for each in frames] == [1, 2]
    assert assembler.torn == assembler.lost == 0


def test_a_torn_packet_costs_its_frame(images: NDArray[np.uint8]) -> None:
    sent = stream(images, 1, 2)
    sent[13] = sent[13][:500]
    assembler = Assembler()

    assert [each.sequence for each in received(assembler, sent)] == [2]
    assert (assembler.torn, assembler.lost) == (1, 1)


def test_the_borders_of_packets_mean_nothing(images: NDArray[np.uint8]) -> None:
    data = b"".join(stream(images, 1, 2))
    cuts = np.sort(np.random.default_rng(4).integers(0, len(data), 300)).tolist()
    # a sub-image ends with a packet
    ends = range(0, len(data), SUB_IMAGE_BYTES + 152)
    borders = sorted({0, len(data), *cuts, *ends})
    pieces = [data[a:b] for a, b in pairwise(borders)]

    assert [each.sequence for each in received(Assembler(), pieces)] == [1, 2]


def test_frames_that_never_came_are_counted(images: NDArray[np.uint8]) -> None:
    assembler = Assembler()

    frames = received(assembler, stream(images, 2**32 - 1, 3, 1_000_000, 5))

    # 0, 1 and 2 are missing; what is far ahead or behind is a stream that began anew
    assert [each.lost for each in frames] == [0, 3 * MEASURED, 0, 0]
    assert assembler.lost == 3 * MEASURED
    assert assembler.incomplete_frames == 0


def test_a_tenth_sub_image_or_an_eleventh_are_not_waited_for(images: NDArray[np.uint8]) -> None:
    sent = stream(images, 1)[: 9 * PER_SUB_IMAGE]
    wrong = bytes(SUB_IMAGE_BYTES) + Footer(MAGIC, 5, 2, 10).pack()
    assembler = Assembler()

    assert received(assembler, [wrong, b"", *sent])[0].sequence == 1
    assert assembler.torn == 1


def test_what_is_no_stream_is_passed_over(images: NDArray[np.uint8]) -> None:
    rng = np.random.default_rng(5)
    assembler = Assembler()
    noise = [rng.bytes(int(size)) for size in rng.integers(0, 100_000, 200)]

    assert received(assembler, noise) == []
    assert assembler.torn > 0
    assembler.reset()
    assert [each.sequence for each in received(assembler, stream(images, 1))] == [1]


def test_a_stream_that_was_stopped_begins_anew(images: NDArray[np.uint8]) -> None:
    assembler = Assembler()
    assert received(assembler, stream(images, 1)[:57]) == []

    assembler.reset()

    assert [each.lost for each in received(assembler, stream(images, 1))] == [0]


def test_frames_are_not_overwritten_by_later_ones(images: NDArray[np.uint8]) -> None:
    first, second = received(Assembler(), [*stream(images, 1), *stream(images[::-1], 2)])

    assert (first.data == images).all()
    assert (second.data == images[::-1]).all()
