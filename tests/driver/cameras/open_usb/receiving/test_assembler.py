from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from transientcam_driver import Counters, RawFrame, Sequence
from transientcam_driver.cameras.open_usb._receiving.assembler import FrameAssembler
from transientcam_driver.cameras.open_usb._receiving.decoder import ImagePacket
from transientcam_driver.cameras.open_usb.protocol import ImageFlag, ImageHeader, phase_word
from transientcam_simulation.emulated._open_usb.prototype import prototype

CAPABILITIES = prototype(serial="T", width=4, height=3, bits=12)
APPLIED = CAPABILITIES.apply(Sequence(harmonics=1, zeroth="on-off"), epoch=5)
LABELS = APPLIED.labels
COUNT = len(LABELS)
PERIOD_NS = 5_900_000


def image(number: int, *, frame: int | None = None, epoch: int = 5) -> ImagePacket:
    """Image ``number`` of an endless run of frames."""
    label = LABELS[number % COUNT]
    header = ImageHeader(
        flags=ImageFlag(0),
        epoch=epoch,
        frame=number // COUNT if frame is None else frame,
        number=number,
        index=label.index,
        count=COUNT,
        tuning_word=round(label.frequency_hz / 0.25),
        phase=phase_word(label.phase_rad),
        harmonic=label.harmonic,
        exposure_ns=1_920_000,
        device_time_ns=10**9 + number * PERIOD_NS,
        temperature_c=30.0 + number / 100,
        payload_bytes=24,
        payload_crc=0,
    )
    return ImagePacket(header, np.full(12, number, "<u2").tobytes())


class Assembly:
    """An assembler with its counters."""

    def __init__(self, first_image: int = 0) -> None:
        self.counters = Counters()
        self.assembler = FrameAssembler(APPLIED, CAPABILITIES, self.counters)
        self.assembler.restart(first_image)

    def push(self, *packets: ImagePacket) -> list[RawFrame]:
        frames = (self.assembler.push(packet, host_time_s=99.0) for packet in packets)
        return [frame for frame in frames if frame is not None]


def test_a_frame_holds_all_images_in_the_order_of_its_labels() -> None:
    (frame,) = Assembly().push(*map(image, range(COUNT)))

    assert frame.images.shape == (COUNT, 3, 4)
    assert frame.images.dtype == np.uint16
    assert frame.images[:, 0, 0].tolist() == list(range(COUNT))
    assert frame.labels == LABELS
    assert (frame.number, frame.epoch, frame.host_time_s, frame.lost_images) == (0, 5, 99.0, 0)


@pytest.mark.parametrize("take_order", ["sequential", "interleaved"])
def test_images_are_had_by_take_in_whichever_order_they_came(take_order: Any) -> None:
    sequence = Sequence(harmonics=1, zeroth="on-off", takes=3, take_order=take_order)
    labels = sequence.labels
    shown = [10 * label.take + 4 * label.harmonic + round(label.phase_rad) for label in labels]
    images = np.array(shown, np.uint16)[:, None, None] * np.ones((1, 3, 4), np.uint16)
    frame = RawFrame(0, 5, images, labels, 0.0, 0.0, 0.0, 0.0, 0)

    by_take = frame.by_take

    assert by_take.shape == (3, 6, 3, 4)
    assert by_take[:, :, 0, 0].tolist() == [
        [10 * take + each for each in (0, 0, 4, 6, 7, 9)] for take in range(3)
    ]
    assert np.shares_memory(by_take, images)


def test_times_are_the_devices_own() -> None:
    _, frame = Assembly().push(*map(image, range(2 * COUNT)))

    assert frame.device_time_s == pytest.approx(1 + COUNT * 5.9e-3)
    assert frame.capture_s == pytest.approx(COUNT * 5.9e-3)
    assert frame.temperature_c == pytest.approx(30 + (2 * COUNT - 1) / 100)


def test_times_are_as_fine_after_ten_days_as_at_once() -> None:
    days_ns = 864_000 * 10**9
    images = [
        replace(each, header=replace(each.header, device_time_ns=days_ns + k * PERIOD_NS))
        for k, each in enumerate(map(image, range(COUNT)))
    ]

    (frame,) = Assembly().push(*images)

    assert frame.device_time_s == pytest.approx(864_000, rel=1e-15)
    assert frame.capture_s == pytest.approx(COUNT * 5.9e-3, abs=1e-9)


@pytest.mark.parametrize("missing", range(COUNT))
def test_a_missing_image_drops_its_frame_and_the_next_frame_counts_it(missing: int) -> None:
    assembly = Assembly()

    frames = assembly.push(*(image(k) for k in range(3 * COUNT) if k != COUNT + missing))

    assert [(frame.number, frame.lost_images) for frame in frames] == [(0, 0), (2, 1)]
    assert assembly.counters.lost == 1
    assert assembly.counters.incomplete_frames == (0 if missing == 0 else 1)


@pytest.mark.parametrize("damaged", range(COUNT))
def test_a_corrupt_image_drops_its_frame_and_the_next_frame_counts_it(damaged: int) -> None:
    assembly = Assembly()

    frames = assembly.push(
        *(replace(image(k), intact=k != COUNT + damaged) for k in range(3 * COUNT))
    )

    assert [(frame.number, frame.lost_images) for frame in frames] == [(0, 0), (2, 1)]
    assert (assembly.counters.corrupt, assembly.counters.lost) == (1, 0)


def test_losses_over_several_frames_add_up_until_one_is_complete() -> None:
    kept = [0, 1, *range(COUNT + 3, 2 * COUNT), *range(2 * COUNT, 3 * COUNT)]

    (frame,) = Assembly().push(*map(image, kept))

    assert frame.lost_images == COUNT + 3 - 2


def test_duplicated_images_are_left_out() -> None:
    assembly = Assembly()

    frames = assembly.push(*(image(k) for number in range(COUNT) for k in (number, number)))

    assert len(frames) == 1
    assert assembly.counters.duplicates == COUNT
    assert assembly.counters.lost == 0


def test_an_image_that_comes_too_late_counts_as_lost_and_does_no_more_harm() -> None:
    assembly = Assembly()

    frames = assembly.push(*map(image, [0, 2, 1, *range(3, 2 * COUNT)]))

    assert [(frame.number, frame.lost_images) for frame in frames] == [(1, 1)]
    assert assembly.counters.duplicates == 1


@pytest.mark.parametrize("epoch", [4, 6])
def test_images_of_another_epoch_are_left_out(epoch: int) -> None:
    assembly = Assembly(first_image=100 * COUNT)
    old = [image(k, epoch=epoch) for k in range(100 * COUNT, 101 * COUNT)]

    frames = assembly.push(*old, *map(image, range(100 * COUNT, 101 * COUNT)))

    assert [frame.number for frame in frames] == [100]
    assert assembly.counters.lost == 0


@pytest.mark.parametrize("number", range(COUNT))
@pytest.mark.parametrize("field", ["tuning_word", "phase", "harmonic", "count"])
@pytest.mark.parametrize("off", [-1, 1])
def test_images_that_were_not_asked_for_count_as_corrupt(number: int, field: str, off: int) -> None:
    assembly = Assembly(first_image=number)
    packet = image(number)
    lie: dict[str, Any] = {field: getattr(packet.header, field) + off}

    assert assembly.push(replace(packet, header=replace(packet.header, **lie))) == []

    assert assembly.counters == Counters(corrupt=1)


@pytest.mark.parametrize("index", [COUNT, COUNT + 1, 600])
def test_an_image_beyond_the_last_one_is_corrupt(index: int) -> None:
    assembly = Assembly()
    packet = image(0)

    assert assembly.push(replace(packet, header=replace(packet.header, index=index))) == []

    assert assembly.counters == Counters(corrupt=1)


def test_the_images_of_two_frames_are_never_mixed() -> None:
    assembly = Assembly()

    frames = assembly.push(
        *(image(k, frame=0) for k in range(3)), *(image(k, frame=1) for k in range(3, COUNT))
    )

    assert frames == []
    assert assembly.counters.incomplete_frames == 1


def test_what_was_lost_before_a_restart_is_not_lost_again() -> None:
    assembly = Assembly()
    assembly.push(image(0))

    assembly.assembler.restart(40 * COUNT)
    (frame,) = assembly.push(*map(image, range(40 * COUNT, 41 * COUNT)))

    assert frame.lost_images == 0


def test_the_first_image_of_a_run_is_missed_too() -> None:
    assembly = Assembly()

    (frame,) = assembly.push(*map(image, range(1, 2 * COUNT)))

    assert (frame.number, frame.lost_images) == (1, 1)


def test_a_run_begins_with_image_0_where_nothing_is_said() -> None:
    counters = Counters()
    assembler = FrameAssembler(APPLIED, CAPABILITIES, counters)

    assembler.push(image(1), host_time_s=99.0)

    assert counters.lost == 1


def test_every_image_is_counted_once_by_what_became_of_it() -> None:
    assembly = Assembly()
    good = [image(k) for k in range(2 * COUNT)]
    other = [image(k, epoch=4) for k in range(3)]
    damaged = replace(image(2 * COUNT), intact=False)
    late = image(2 * COUNT + 3)

    frames = assembly.push(*good, good[0], *other, damaged, late, late)

    assert len(frames) == 2
    assert assembly.counters == Counters(
        images=2 * COUNT + 1, frames=2, lost=2, corrupt=1, duplicates=2
    )


def test_images_of_a_frame_after_a_missing_one_are_counted_too() -> None:
    assembly = Assembly()

    assembly.push(*(image(k) for k in range(COUNT) if k != 1))

    assert assembly.counters == Counters(images=COUNT - 1, lost=1, incomplete_frames=1)
