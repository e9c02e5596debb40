"""From packets to frames, without a thread: losses, room, times."""

import numpy as np
import pytest

from tests.driver.cameras.kinect2.standing import STILL, emulated
from transientcam_driver import CameraError, CameraLost, Counters
from transientcam_driver.camera import AppliedSequence
from transientcam_driver.cameras.kinect2 import Identity, capabilities_of, codes, encoder
from transientcam_driver.cameras.kinect2._frame_queue import ROOM_FRAMES, Arrival, FrameQueue
from transientcam_driver.cameras.kinect2._frames import FrameMaker
from transientcam_driver.cameras.kinect2._packets import SubImages
from transientcam_driver.clock import VirtualClock
from transientcam_driver.sequence import Sequence
from transientcam_simulation.emulated import Fault

PERIOD_TICKS = 266
CAPABILITIES = capabilities_of(Identity("1", "2", b"", b""))


def frame(sequence: int) -> list[bytes]:
    ticks = sequence * PERIOD_TICKS
    return list(encoder.packets(STILL.data, sequence=sequence, timestamp=ticks))


def push(frame_queue: FrameQueue, packets: list[bytes]) -> None:
    for packet in packets:
        frame_queue.push(packet)


@pytest.fixture
def counters() -> Counters:
    return Counters()


@pytest.fixture
def frame_queue(counters: Counters) -> FrameQueue:
    return FrameQueue(counters, VirtualClock(start_s=5.0, unix_s=1e9))


def test_a_frame_is_handed_over_with_the_time_at_which_it_was_complete(
    frame_queue: FrameQueue, counters: Counters
) -> None:
    push(frame_queue, frame(7))
    arrival = frame_queue.take(0.0)

    assert arrival is not None
    assert (arrival.now_s, arrival.unix_s, arrival.lost) == (5.0, 1e9, 0)
    assert np.array_equal(arrival.sub_images.data, STILL.data)
    assert (counters.images, counters.lost) == (9, 0)
    assert frame_queue.take(0.0) is None


@pytest.mark.parametrize("torn", [False, True], ids=["lost", "torn"])
def test_a_packet_that_is_lost_or_torn_costs_one_image(
    frame_queue: FrameQueue, counters: Counters, torn: bool
) -> None:
    corrupt = frame(0)
    corrupt[3:4] = [corrupt[3][:100]] if torn else []
    push(frame_queue, corrupt)
    push(frame_queue, frame(1))
    arrival = frame_queue.take(0.0)

    assert arrival is not None
    assert (arrival.sub_images.sequence, arrival.lost) == (1, 1)
    assert (counters.lost, counters.incomplete_frames, counters.resyncs) == (1, 1, 1)


def test_what_is_not_read_in_time_is_dropped_from_the_oldest_on_and_counted(
    frame_queue: FrameQueue, counters: Counters
) -> None:
    for sequence in range(ROOM_FRAMES + 2):
        push(frame_queue, frame(sequence))

    arrivals = [frame_queue.take(0.0) for _ in range(ROOM_FRAMES + 1)]

    assert [each and (each.sub_images.sequence, each.lost) for each in arrivals] == [
        (2, 18),
        *((sequence, 0) for sequence in range(3, ROOM_FRAMES + 2)),
        None,
    ]
    assert counters.lost == 18


def test_a_failure_comes_behind_the_frames_before_it_and_ends_with_a_restart(
    frame_queue: FrameQueue,
) -> None:
    push(frame_queue, frame(0))
    frame_queue.fail(CameraLost("gone"))

    assert frame_queue.take(60.0) is not None
    with pytest.raises(CameraLost, match="gone"):
        frame_queue.take(60.0)
    frame_queue.restart()
    assert frame_queue.take(0.0) is None


def test_an_end_releases_the_reader_and_drops_what_there_is(frame_queue: FrameQueue) -> None:
    push(frame_queue, frame(0))
    frame_queue.end()

    assert frame_queue.take(60.0) is None


def applied(takes: int = 1) -> AppliedSequence:
    return CAPABILITIES.apply(CAPABILITIES.nearest(Sequence(takes=takes)), epoch=3)


def arrival(sequence: int, timestamp: int, *, now_s: float = 10.0, lost: int = 0) -> Arrival:
    return Arrival(SubImages(sequence, timestamp, STILL.data, lost), now_s, 1e9, lost)


def test_times_are_steps_of_the_stream_from_the_arrival_of_its_first_frame() -> None:
    maker = FrameMaker(2.0)
    last = (1 << 32) - 100
    frames = [
        maker.push(arrival(0, last), applied()),
        maker.push(arrival(1, last + PERIOD_TICKS - (1 << 32), now_s=99.0), applied()),
    ]
    maker.restart()
    frames.append(maker.push(arrival(0, 0, now_s=9.0), applied()))

    times_s = [each.device_time_s for each in frames if each is not None]
    first_s = 10.0 - 2.0 - 1 / 30
    second_s = first_s + PERIOD_TICKS * 0.125e-3
    # the third arrived before the second by this machine's clock: times grow all the same
    assert times_s == pytest.approx([first_s, second_s, second_s + 0.125e-3])
    assert [each and (each.number, each.epoch) for each in frames] == [(0, 3), (1, 3), (2, 3)]


def test_images_lost_before_any_take_of_a_frame_are_counted_in_it() -> None:
    maker = FrameMaker(0.0)
    two = applied(takes=2)

    assert maker.push(arrival(0, 0), two) is None
    frame = maker.push(arrival(4, 4 * PERIOD_TICKS, lost=27), two)

    assert frame is not None
    assert (frame.lost_images, frame.number) == (27, 2)
    assert frame.capture_s == pytest.approx(4 * PERIOD_TICKS * 0.125e-3 + 1 / 30)
    assert np.array_equal(frame.by_take[1], codes.frame_images(STILL.data))


@pytest.mark.parametrize("fault", [Fault.DROP, Fault.CORRUPT_PIXELS])
def test_a_fault_of_the_emulated_cable_spoils_a_packet_of_as_many_images(fault: Fault) -> None:
    device = emulated()
    whole = [len(packet) for packet in device.frame()]
    device.inject(fault, 2)

    corrupt, after = ([len(packet) for packet in device.frame()] for _ in range(2))

    missing = sum(whole) - sum(corrupt)
    assert missing == 2 * 33_792 // (1 if fault is Fault.DROP else 2)
    assert corrupt.count(0) == 10
    assert after == whole


def test_a_fault_that_the_camera_cannot_have_is_refused() -> None:
    with pytest.raises(CameraError, match="babble"):
        emulated().inject(Fault.BABBLE)
