"""Bytes of a connection to frames, through changes of the sequence and new runs."""

import numpy as np
import pytest

from transientcam_driver import Counters, ProtocolError, RawFrame, Sequence
from transientcam_driver.cameras.open_usb._receiving.receiver import Receiver
from transientcam_driver.cameras.open_usb.protocol import (
    ImageFlag,
    ImageHeader,
    payload_checksum,
    phase_word,
)
from transientcam_simulation.emulated._open_usb.prototype import prototype

CAPABILITIES = prototype(serial="T", width=4, height=3, bits=12)
APPLIED = CAPABILITIES.apply(Sequence(harmonics=1, zeroth="on-off"), epoch=5)
COUNT = len(APPLIED.labels)


def image(number: int, *, epoch: int = 5, pixels: int = 12) -> bytes:
    """Image ``number`` of an endless run of frames, as it comes over the bus."""
    label = APPLIED.labels[number % COUNT]
    payload = np.full(pixels, number, "<u2").tobytes()
    header = ImageHeader(
        flags=ImageFlag(0),
        epoch=epoch,
        frame=number // COUNT,
        number=number,
        index=label.index,
        count=COUNT,
        tuning_word=round(label.frequency_hz / 0.25),
        phase=phase_word(label.phase_rad),
        harmonic=label.harmonic,
        exposure_ns=1_920_000,
        device_time_ns=number,
        temperature_c=30.0,
        payload_bytes=len(payload),
        payload_crc=payload_checksum(payload),
    )
    return header.pack() + payload


def images(first: int, last: int, *, epoch: int = 5) -> memoryview:
    """Images from the first to the one before the last, back to back."""
    return memoryview(b"".join(image(k, epoch=epoch) for k in range(first, last)))


@pytest.fixture
def counters() -> Counters:
    return Counters()


@pytest.fixture
def receiver(counters: Counters) -> Receiver:
    receiver = Receiver(CAPABILITIES, counters)
    receiver.switch(APPLIED, first_image=0)
    return receiver


def taken(receiver: Receiver) -> list[RawFrame]:
    return list(iter(receiver.take, None))


def test_frames_are_taken_in_the_order_in_which_they_came(receiver: Receiver) -> None:
    receiver.feed(images(0, 3 * COUNT), host_time_s=99.0)

    found = taken(receiver)

    assert [(each.number, each.host_time_s) for each in found] == [(0, 99.0), (1, 99.0), (2, 99.0)]
    assert found[1].images[:, 0, 0].tolist() == list(range(COUNT, 2 * COUNT))


def test_images_before_the_first_sequence_are_passed_over(counters: Counters) -> None:
    receiver = Receiver(CAPABILITIES, counters)
    receiver.restart(first_image=0)

    receiver.feed(images(0, COUNT), host_time_s=0.0)

    assert receiver.take() is None
    assert counters == Counters()


def test_a_new_sequence_leaves_nothing_of_the_one_before(
    receiver: Receiver, counters: Counters
) -> None:
    receiver.feed(images(0, COUNT + 1), host_time_s=0.0)

    receiver.switch(CAPABILITIES.apply(APPLIED.sequence, epoch=6), first_image=2 * COUNT)
    receiver.feed(images(COUNT + 1, 2 * COUNT), host_time_s=0.0)
    receiver.feed(images(2 * COUNT, 3 * COUNT, epoch=6), host_time_s=0.0)

    assert [(each.number, each.epoch) for each in taken(receiver)] == [(2, 6)]
    assert counters.lost == 0


@pytest.mark.parametrize("part", [1, 64, 70])
def test_a_new_run_begins_with_its_first_image_and_whole_packets(
    receiver: Receiver, counters: Counters, part: int
) -> None:
    receiver.feed(images(0, COUNT), host_time_s=0.0)
    receiver.feed(images(COUNT, COUNT + 1)[:part], host_time_s=0.0)

    receiver.restart(first_image=2 * COUNT)
    receiver.feed(images(2 * COUNT, 3 * COUNT), host_time_s=0.0)

    assert [each.number for each in taken(receiver)] == [2]
    assert (counters.lost, counters.resyncs) == (0, 0)


def test_what_came_of_a_failed_transfer_is_dropped_and_counted(
    receiver: Receiver, counters: Counters
) -> None:
    receiver.feed(images(0, 1)[:70], host_time_s=0.0)
    receiver.resynchronise()
    receiver.feed(images(COUNT, 2 * COUNT), host_time_s=0.0)

    assert [each.number for each in taken(receiver)] == [1]
    assert (counters.resyncs, counters.lost) == (1, COUNT)


def test_bytes_between_images_are_counted_once_for_each_place(
    receiver: Receiver, counters: Counters
) -> None:
    receiver.feed(memoryview(image(0) + b"noise" + image(1)), host_time_s=0.0)
    for k in range(2, COUNT):
        receiver.feed(memoryview(b"more" + image(k)), host_time_s=0.0)

    assert [each.number for each in taken(receiver)] == [0]
    assert counters.resyncs == COUNT - 1


def test_images_of_another_size_are_named_until_a_new_run(receiver: Receiver) -> None:
    receiver.feed(images(0, 1), host_time_s=0.0)
    receiver.require_images_of_the_size_announced()
    receiver.feed(memoryview(image(1, pixels=11)), host_time_s=0.0)

    with pytest.raises(ProtocolError, match="images of 22 bytes, its capabilities say 24"):
        receiver.require_images_of_the_size_announced()
    receiver.restart(first_image=0)
    receiver.require_images_of_the_size_announced()
